"""Effects that a model may lack, each as something that it can be extended by."""

import copy
import dataclasses
from collections.abc import Sequence
from typing import Self

from drake_disasm.effects import (
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
    model: LogModel, library: Sequence[type[Effect]] | None = None
) -> list[Candidate]:
    """Returns what of a library, or of all that is registered, a model could carry."""
    library = registered_effects() if library is None else library
    return [Candidate.of(effect) for effect in model.applicable_effects(library)]


def extended(
    model: LogModel, chosen: Sequence[Candidate], with_shapes: bool = False
) -> tuple[LogModel, list[range]]:
    """Returns a model with candidates among its effects, and their sizes as parameters.

    And which of its parameters are new, candidate by candidate.

    An effect that the model has already gets the parameters that were not free.

    Args:
        model: to extend.
        chosen: candidates.
        with_shapes: whether their shapes are parameters, too.
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
        if type(effect) is type(wanted) and _looks(effect) == _looks(wanted):
            return number
    effects.append(copy.deepcopy(wanted))
    return len(effects) - 1


def _looks(effect: Effect) -> tuple[object, ...]:
    """Returns what tells effects of a kind apart, whatever their sizes."""
    kind = type(effect)
    return tuple(
        getattr(effect, f.name)
        for f in dataclasses.fields(kind)
        if f.name not in amplitudes(kind)
    )
