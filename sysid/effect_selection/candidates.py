"""Effects that a model may lack, each as something that it can be extended by."""

import copy
import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any, Self

from drake_disasm.effects import (
    EFFECTS,
    ArmEffect,
    ContactExponent,
    Effect,
    EnvironmentEffect,
    JointEffect,
    MotionEffect,
    SensorEffect,
    SensorMemoryEffect,
    amplitudes,
    shape_parameters,
)
from drake_disasm.scenario import Scenario
from sysid.models.base import ScenarioModel
from sysid.models.joint_motion import JointMotionModel
from sysid.models.static_wrench import StaticWrenchModel
from sysid.parameters import Parameter
from sysid.scenario_parameters import Request, scenario_parameters


@dataclasses.dataclass(frozen=True)
class Candidate:
    """An effect in one of its shapes, at its null value.

    Attributes:
        name: of the effect, with its joint if it has one.
        effect: at null.
        fields: its sizes that are free.
    """

    name: str
    effect: Effect
    fields: tuple[str, ...]

    @classmethod
    def of(cls, effect: Effect) -> Self:
        """Returns the candidate of an effect with all its sizes free."""
        kind, joint = type(effect), getattr(effect, "joint", "")
        name = f"{kind.__name__}.{joint}" if joint else kind.__name__
        return cls(name, effect, amplitudes(kind))

    def only(self, fields: Sequence[str]) -> Self:
        """Returns the same with fewer sizes free."""
        return dataclasses.replace(self, fields=tuple(fields))

    @property
    def text(self) -> str:
        """The name with the shape."""
        shape = ", ".join(f"{name}={value:g}" for name, value in self.shape.items())
        return f"{self.name}[{shape}]" if shape else self.name

    @property
    def shape(self) -> dict[str, float]:
        """Values of its shape parameters."""
        return {
            name: getattr(self.effect, name)
            for name in shape_parameters(type(self.effect))
        }


def candidates(
    model: ScenarioModel, library: Sequence[type[Effect]] = EFFECTS
) -> list[Candidate]:
    """Returns what of a library could act on a model's channels."""
    if isinstance(model, JointMotionModel):
        joints = [channel.name for channel in model.measurements.channels]
        kinds = [kind for kind in library if issubclass(kind, ArmEffect)]
        return [
            Candidate.of(effect)
            for kind in kinds
            for place in _places(kind, joints)
            for effect in _in_all_shapes(kind, **place)
        ]
    acts: tuple[type[Effect], ...] = (EnvironmentEffect, MotionEffect, SensorEffect)
    silent: tuple[type[Effect], ...] = (ContactExponent,)
    if isinstance(model, StaticWrenchModel):
        acts, silent = (SensorEffect,), (SensorMemoryEffect,)
    elif model.scenario.contact.model == "impact":
        silent = ()
    return [
        Candidate.of(effect)
        for kind in library
        if issubclass(kind, acts) and not issubclass(kind, silent)
        if not kind.is_random  # see scatter.py
        for effect in _in_all_shapes(kind)
    ]


def extended(
    model: ScenarioModel, chosen: Sequence[Candidate], with_shapes: bool = False
) -> tuple[ScenarioModel, list[range]]:
    """Returns a model with candidates in its scenario, and their sizes as parameters.

    And which of its parameters are new, candidate by candidate.

    An effect that the scenario has already gets the parameters that were not free.

    Args:
        model: to extend.
        chosen: candidates.
        with_shapes: whether their shapes are parameters, too.
    """
    scenario = copy.deepcopy(model.scenario)
    taken = {parameter.path for parameter in model.parameters}
    parameters: list[Parameter] = []
    groups = []
    for candidate in chosen:
        number = _place(scenario, candidate)
        kind = type(candidate.effect)
        name = candidate.name if with_shapes else candidate.text
        fields = candidate.fields + (
            tuple(shape_parameters(kind)) if with_shapes else ()
        )
        paths = {f"effects.{number}.{field}": field for field in fields}
        requests = [Request(path) for path in paths if path not in taken]
        _, found = scenario_parameters(scenario, requests)
        parameters += [
            dataclasses.replace(p, name=f"{name}.{paths[p.path]}") for p in found
        ]
        taken |= set(paths)
        count = len(model.parameters) + len(parameters)
        groups.append(range(count - len(found), count))
    return model.extended(scenario, parameters), groups


def _place(scenario: Scenario, candidate: Candidate) -> int:
    """Returns where a candidate stands in the scenario, which gets it if need be."""
    wanted = candidate.effect
    for number, effect in enumerate(scenario.effects):
        if type(effect) is type(wanted) and _looks(effect) == _looks(wanted):
            return number
    scenario.effects.append(copy.deepcopy(wanted))
    return len(scenario.effects) - 1


def _places(kind: type[ArmEffect], joints: Sequence[str]) -> list[dict[str, str]]:
    """Returns where an arm's effect may act: at each joint, or on the arm."""
    if issubclass(kind, JointEffect):
        return [{"joint": joint} for joint in joints]
    return [{}]


def _in_all_shapes(kind: type[Effect], **fields: Any) -> list[Effect]:
    grids = shape_parameters(kind)
    return [
        kind(**fields, **dict(zip(grids, values, strict=True)))
        for values in itertools.product(*grids.values())
    ]


def _looks(effect: Effect) -> tuple[object, ...]:
    """Returns what tells effects of a kind apart, whatever their sizes."""
    kind = type(effect)
    return tuple(
        getattr(effect, f.name)
        for f in dataclasses.fields(kind)  # type: ignore[arg-type]
        if f.name not in amplitudes(kind)
    )
