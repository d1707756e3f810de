"""Parameters that identification may vary, each with unit, bounds and scale."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError

Vector = NDArray[np.float64]

#: Bounds of one sign with a larger ratio than this are searched by logarithm.
DECADES = 1e3


@dataclass(frozen=True)
class Parameter:
    """One number that a model depends on.

    Attributes:
        name: for people, such as `contact.friction` or `GroovePose.ry`.
        nominal: the value to start from.
        low, high: inclusive bounds; finite.
        unit: SI unit, "1" for a pure number.
        doc: what it is, in a line.
        log_scale: whether it is searched by its logarithm, for bounds that span
            decades.
        path: where it stands in a scenario, such as `effects.0.ry`; the name itself
            if it is left out.
        is_shape: whether it is a shape parameter of an effect, not an amplitude.
        first_step: over which its derivative is first taken, in its unit; of none that
            is searched by its logarithm. None: a share of the bounds.
    """

    name: str
    nominal: float
    low: float
    high: float
    unit: str = "1"
    doc: str = ""
    log_scale: bool = False
    path: str = ""
    is_shape: bool = False
    first_step: float | None = None

    @classmethod
    def of_field(
        cls,
        name: str,
        path: str,
        value: float,
        metadata: Mapping[str, Any],
        log_scale: bool | None = None,
    ) -> Self:
        """Returns the parameter that stands for a field of a dataclass.

        Args:
            name: of the parameter.
            path: of the field.
            value: nominal.
            metadata: of the field, as `common.quantity.quantity` makes it.
            log_scale: whether it is searched by its logarithm; None decides by the
                bounds.

        Raises:
            DisasmError: the field has no finite bounds.
        """
        low, high = metadata["low"], metadata["high"]
        return cls(
            name,
            value,
            low,
            high,
            metadata["unit"],
            metadata["doc"],
            low > 0.0 and high > DECADES * low if log_scale is None else log_scale,
            path,
            bool(metadata.get("grid")),
            metadata.get("step"),
        )

    def __post_init__(self) -> None:
        """Refuses bounds that no search can use."""
        for word, bound in (("low", self.low), ("high", self.high)):
            if not math.isfinite(bound):
                raise DisasmError(
                    f"{self.name}: {word} is {bound}; give a finite bound, "
                    "a search needs a box"
                )
        if self.low >= self.high:
            raise DisasmError(
                f"{self.name}: low {self.low:g} is not below high {self.high:g}; "
                "swap them"
            )
        if not self.low <= self.nominal <= self.high:
            raise DisasmError(
                f"{self.name}: the nominal value {self.nominal:g} is not within "
                f"{self.low:g} to {self.high:g}; widen the bounds or give a nominal"
            )
        if self.log_scale and self.low <= 0.0:
            raise DisasmError(
                f"{self.name}: a logarithmic scale from {self.low:g}; give a low "
                "above zero, or scale: linear"
            )


class Scaling:
    """Maps parameters to the unit box [0, 1]^p, where searches work, and back."""

    def __init__(self, parameters: Sequence[Parameter]) -> None:
        self._log = np.array([p.log_scale for p in parameters], dtype=bool)
        bounds = np.array([[p.low, p.high] for p in parameters], dtype=float)
        self._bounds = bounds.reshape(-1, 2)
        ends = self._forward(self._bounds.T)
        self._low, self._span = ends[0], ends[1] - ends[0]

    def to_unit(self, theta: Vector) -> Vector:
        """Returns parameters (..., p) as points of the unit box."""
        return (self._forward(theta) - self._low) / self._span

    def from_unit(self, u: Vector) -> Vector:
        """Returns the parameters (..., p) of points of the unit box.

        They are never outside the bounds, not even by rounding.
        """
        values = self._low + u * self._span
        theta = np.where(self._log, np.exp(np.where(self._log, values, 0.0)), values)
        return np.clip(theta, self._bounds[:, 0], self._bounds[:, 1])

    def slope(self, theta: Vector) -> Vector:
        """Returns d theta / d u (p,) at parameters (p,)."""
        return np.where(self._log, theta * self._span, self._span)

    def _forward(self, theta: Vector) -> Vector:
        safe = np.where(self._log, theta, 1.0)
        return np.where(self._log, np.log(safe), theta)


def nominal_values(parameters: Sequence[Parameter]) -> Vector:
    """Returns the nominal values (p,)."""
    return np.array([p.nominal for p in parameters])


def by_name(parameters: Sequence[Parameter], theta: Vector) -> Mapping[str, float]:
    """Returns the values (p,) by the parameters' names."""
    return {p.name: float(v) for p, v in zip(parameters, theta, strict=True)}


def by_path(
    parameters: Sequence[Parameter], values: Mapping[str, float]
) -> Mapping[str, float]:
    """Returns named values by their paths in a scenario."""
    return {p.path or p.name: values[p.name] for p in parameters if p.name in values}
