"""Effects that a model may lack, each as something that it can be extended by."""

import copy
import dataclasses
from collections.abc import Sequence
from typing import Self

from drake_disasm.effects import (
    ArmEffect,
    Effect,
    amplitudes,
    registered_effects,
    shape_parameters,
)
from sysid.models.base import LogModel
from sysid.models.effects import effect_parameter
from sysid.parameters import Parameter


@dataclasses.dataclass(frozen=True)
class Candidate:
    """An effect in one of its shapes, at its null value.

    Attributes:
        name: of the effect, with its joint if it has one.
        effect: at null.
        fields: names of its amplitudes that are fitted.
    """

    name: str
    effect: Effect
    fields: tuple[str, ...]

    @classmethod
    def of(cls, effect: Effect) -> Self:
        """Returns the candidate of an effect with all its amplitudes free."""
        kind, joint = type(effect), getattr(effect, "joint", "")
        name = f"{kind.__name__}.{joint}" if joint else kind.__name__
        return cls(name, effect, amplitudes(kind))

    def only(self, fields: Sequence[str]) -> Self:
        """Returns the same with fewer amplitudes free."""
        return dataclasses.replace(self, fields=tuple(fields))

    @property
    def text(self) -> str:
        """The name with the values of the shape parameters."""
        shape = ", ".join(f"{name}={value:g}" for name, value in self.shape.items())
        return f"{self.name}[{shape}]" if shape else self.name

    @property
    def shape(self) -> dict[str, float]:
        """Values of its shape parameters."""
        return {
            name: getattr(self.effect, name)
            for name in shape_parameters(type(self.effect))
        }


def joint_groups(library: Sequence[Candidate]) -> list[tuple[Candidate, ...]]:
    """Returns the same kind of effect at all joints at once, kind by kind.

    An arm that lacks friction at one joint lacks it at the others, and one alone would
    take up what the others lack through the rigid bodies in between.
    """
    groups: dict[str, list[Candidate]] = {}
    for candidate in library:
        if isinstance(candidate.effect, ArmEffect) and candidate.effect.is_common:
            groups.setdefault(kind_text(candidate), []).append(candidate)
    return [tuple(group) for group in groups.values() if len(group) > 1]


def kind_text(candidate: Candidate) -> str:
    """Returns the effect with its shape parameters, without its joint."""
    kind = type(candidate.effect).__name__
    return candidate.text.replace(candidate.name, kind)


def candidates(
    model: LogModel, library: Sequence[type[Effect]] | None = None
) -> list[Candidate]:
    """Returns the effects of a library, or all registered ones, a model may lack."""
    library = registered_effects() if library is None else library
    return [Candidate.of(effect) for effect in model.applicable_effects(library)]


def extended(
    model: LogModel, chosen: Sequence[Candidate], with_shapes: bool = False
) -> tuple[LogModel, list[range]]:
    """Returns a model with candidates, their amplitudes as parameters.

    And which of its parameters are new, candidate by candidate. Of an effect that the
    model has already, those amplitudes become parameters that are not yet.

    Args:
        model: to extend.
        chosen: candidates.
        with_shapes: whether shape parameters are fitted, too.
    """
    effects = list(copy.deepcopy(model.effects))
    taken = {parameter.path for parameter in model.parameters}
    parameters: list[Parameter] = []
    groups = []
    for candidate in chosen:
        number = _place(effects, candidate)
        name = candidate.name if with_shapes else candidate.text
        begin = len(model.parameters) + len(parameters)
        for field in candidate.fields + (tuple(candidate.shape) * with_shapes):
            added = effect_parameter(effects, number, field, f"{name}.{field}")
            if added.path not in taken:
                parameters.append(added)
                taken.add(added.path)
        groups.append(range(begin, len(model.parameters) + len(parameters)))
    return model.with_effects(effects, parameters), groups


def _place(effects: list[Effect], candidate: Candidate) -> int:
    """Returns a candidate's place among effects, to which it is added if need be."""
    wanted = candidate.effect
    for number, effect in enumerate(effects):
        if type(effect) is type(wanted) and _identity(effect) == _identity(wanted):
            return number
    effects.append(copy.deepcopy(wanted))
    return len(effects) - 1


def _identity(effect: Effect) -> tuple[object, ...]:
    """Returns what distinguishes effects of a kind, whatever their amplitudes."""
    kind = type(effect)
    return tuple(
        getattr(effect, f.name)
        for f in dataclasses.fields(kind)
        if f.name not in amplitudes(kind)
    )
