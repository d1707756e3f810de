"""Logs of which some are references: effects are changes, and act in the others."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import Effect, Reach
from sysid.models.base import Array, LogModel
from sysid.models.effects import field_of
from sysid.models.validity import Validity
from sysid.parameters import Parameter

#: Before the names of an effect's parameters: both may have an effect of one name.
_KNOWN, _CHANGE = "reference", "change"
#: What is the same of the model inside.
_AS_INNER = (
    *("affine", "makes_contact", "setting", "effect_types", "shown_elsewhere"),
    *("held_out_share", "assumptions", "rows_in_use"),
)


class ChangedModel(LogModel):
    """What references and newer logs have in common, and what changed in between.

    Parameters of the references' model, its effects included, are fitted to all logs.
    Effects that are added act in the newer logs alone: a change of friction is an
    effect of friction besides that of the references, in units of the same parameter.

    Attributes:
        known: of the references' rows.
        newer: of the others; its effects are those of `known` and the changes.
    """

    is_of_changes = True

    def __init__(
        self,
        model: LogModel,
        is_newer: NDArray[np.bool_],
        values: Mapping[str, float] | None = None,
    ) -> None:
        """Splits a model.

        Args:
            model: of all logs, with the effects that references show.
            is_newer: (rows,) which rows are no references; they come last.
            values: of the model's parameters, by name, from which fits begin; nominal
                ones where there is none.

        Raises:
            DisasmError: all rows are newer, or none is.
        """
        self.measurements = model.measurements
        if is_newer.all() or not is_newer.any():
            raise DisasmError("give at least one reference, and one log to compare")
        self.known, self.newer = (
            model.of_rows(~is_newer),
            model.of_rows(is_newer).with_known_links(),
        )
        self.parameters = tuple(_own(p, values or {}) for p in model.parameters)
        self.__dict__.update({name: getattr(model, name) for name in _AS_INNER})
        self._own_count = len(model.parameters)

    @property
    def is_newer(self) -> NDArray[np.bool_]:
        """Which rows (rows,) are no references."""
        return np.arange(self.measurements.rows) >= self.known.measurements.rows

    def with_effects(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter] = ()
    ) -> Self:
        """See LogModel: the effects are changes, and may be of either sign."""
        found = super().with_effects(effects, [both_ways(p) for p in parameters])
        return found._with_newer()

    def freeze(self, values: Mapping[str, float]) -> Self:
        """See LogModel."""
        return super().freeze(values)._with_newer()

    def _with_newer(self) -> Self:
        """Returns the same with the changes that it has in the newer logs' model."""
        before = self.known.effects
        own = [moved_behind(p, len(before)) for p in self.parameters if field_of(p)]
        unchanged = self.newer.replace(
            _effects=before, parameters=self.known.parameters
        )
        return self.replace(newer=unchanged.with_effects([*before, *self.effects], own))

    def simulate(self, theta: Array, rows: slice) -> Array:
        """See LogModel; rows of newer logs come after all others."""
        theta = self.with_frozen(theta)
        count = self.known.measurements.rows
        if rows.stop <= count:
            return self.known.simulate(theta[: self._own_count], rows)
        own = slice(rows.start - count, rows.stop - count)
        return self.newer.simulate(theta, own)

    def simulate_all(self, thetas: Array, rows: slice) -> list[Array | str]:
        """See LogModel."""
        full = np.array([self.with_frozen(theta) for theta in thetas])
        count = self.known.measurements.rows
        if rows.stop <= count:
            return self.known.simulate_all(full[:, : self._own_count], rows)
        own = slice(rows.start - count, rows.stop - count)
        return self.newer.simulate_all(full, own)

    @property
    def together(self) -> int:
        """See LogModel."""
        return self.newer.together

    def read(self, theta: Array, rows: slice, simulated: Array) -> Array:
        """See LogModel."""
        theta = self.with_frozen(theta)
        found = []
        for model, begin in self._parts():
            own = slice(
                max(rows.start - begin, 0),
                min(rows.stop - begin, model.measurements.rows),
            )
            if own.start < own.stop:
                at = slice(
                    begin + own.start - rows.start, begin + own.stop - rows.start
                )
                values = theta[: len(model.parameters)]
                found.append(model.read(values, own, simulated[at]))
        return np.concatenate(found)

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel; `rows` may be of both parts."""
        parts = [
            self.simulate(
                theta, slice(max(c.start, rows.start), min(c.stop, rows.stop))
            )
            for c in self.chunks()
            if c.start < rows.stop and rows.start < c.stop
        ]
        return self.read(theta, rows, np.concatenate(parts))

    def chunks(self) -> list[slice]:
        """See LogModel."""
        return [
            slice(begin + chunk.start, begin + chunk.stop)
            for model, begin in self._parts()
            for chunk in model.chunks()
        ]

    def _parts(self) -> list[tuple[LogModel, int]]:
        """Returns both models, with the number of their first row."""
        return [(self.known, 0), (self.newer, self.known.measurements.rows)]

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """See LogModel."""
        count = self.known.measurements.rows
        return self.replace(
            known=self.known.of_rows(mask[:count]),
            newer=self.newer.of_rows(mask[count:]),
        )

    def with_begins(self, theta: Array | None) -> Self:
        """See LogModel."""
        full = None if theta is None else self.with_frozen(theta)
        own = None if full is None else full[: self._own_count]
        return self._of(self.known.with_begins(own), self.newer.with_begins(full))

    def surrogate(self) -> Self:
        """See LogModel."""
        return self._of(self.known.surrogate(), self.newer.surrogate())

    def _of(self, known: LogModel, newer: LogModel) -> Self:
        """Returns the same of other models; itself, if they are its own."""
        if known is self.known and newer is self.newer:
            return self
        return self.replace(known=known, newer=newer)

    @property
    def costly(self) -> bool:
        """See LogModel."""
        return self.newer.costly

    @property
    def joints(self) -> tuple[str, ...]:
        """See LogModel."""
        return self.newer.joints

    @property
    def reach(self) -> Reach:
        """See LogModel."""
        return self.newer.reach

    @property
    def travel(self) -> dict[str, float]:
        """See LogModel: a change is shown by the newer logs' motion."""
        return dict(self.newer.travel)

    @property
    def one_way(self) -> tuple[str, ...]:
        """See LogModel."""
        return self.newer.one_way

    @property
    def filter_rows(self) -> int:
        """See LogModel."""
        return max(self.known.filter_rows, self.newer.filter_rows)

    @property
    def piece(self) -> NDArray[np.int64]:
        """See LogModel."""
        known, newer = self.known.piece, self.newer.piece
        return np.concatenate([known, known.max(initial=-1) + 1 + newer])

    @property
    def noise_groups(self) -> tuple[str, ...]:
        """See LogModel."""
        return self.newer.noise_groups

    def applicable_effects(self, library: Sequence[type[Effect]]) -> list[Effect]:
        """See LogModel."""
        return self.newer.applicable_effects(library)

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel."""
        known, newer = self.known.covariates(channel), self.newer.covariates(channel)
        return {name: np.concatenate([known[name], newer[name]]) for name in newer}

    def validity(self, theta: Array) -> Validity | None:
        """See LogModel."""
        return self.newer.validity(self.with_frozen(theta))


def _own(parameter: Parameter, values: Mapping[str, float]) -> Parameter:
    """Returns a parameter of the references' model as one that no effect owns."""
    value = values.get(parameter.name, parameter.nominal)
    within = float(np.clip(value, parameter.low, parameter.high))
    if not field_of(parameter):
        return dataclasses.replace(parameter, nominal=within)
    name = f"{_KNOWN} {parameter.name}"
    return dataclasses.replace(parameter, name=name, path="", nominal=within)


def both_ways(parameter: Parameter) -> Parameter:
    """Returns an amplitude that may fall as far as it may rise."""
    if parameter.is_shape or parameter.log_scale:
        return parameter
    return dataclasses.replace(parameter, low=min(parameter.low, -parameter.high))


def moved_behind(parameter: Parameter, count: int) -> Parameter:
    """Returns a field of an effect that is a change, and comes after other effects.

    Args:
        parameter: whose path is `effects.0.size` and the like.
        count: number of the other effects.
    """
    head, number, field = parameter.path.split(".")
    path = f"{head}.{int(number) + count}.{field}"
    return dataclasses.replace(parameter, name=f"{_CHANGE} {parameter.name}", path=path)
