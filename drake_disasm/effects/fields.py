"""The fields of an effect: amplitudes, shape parameters, and an arm's joint."""

import dataclasses
from typing import Any

from drake_disasm.common.quantity import quantity


def amplitude(
    unit: str, low: float, high: float, doc: str, step: float | None = None
) -> Any:
    """Returns a field that says how large an effect is; its default, zero, is null.

    Args:
        unit: SI unit, "1" for a pure number.
        low, high: inclusive bounds, with zero between them.
        doc: what it is, in a line.
        step: from null, over which a search first looks at what it does; None leaves
            that to the search.
    """
    return quantity(0.0, unit, doc, low=low, high=high, step=step)


def shape_parameter(
    default: float,
    unit: str,
    low: float,
    high: float,
    doc: str,
    grid: tuple[float, ...],
) -> Any:
    """Returns a field that says how an effect looks, and matters only away from null.

    Args:
        default: its value unless a scenario gives another.
        unit: SI unit, "1" for a pure number.
        low, high: inclusive bounds.
        doc: what it is, in a line.
        grid: values from which searches start.
    """
    return quantity(default, unit, doc, low=low, high=high, grid=grid)


def joint_name() -> Any:
    """Returns the field that names the joint at which an effect acts."""
    return quantity("", "", "name of the joint in the URDF")


def file_name() -> Any:
    """Returns the field that names a file beside the scenario."""
    return quantity("", "", "file of the learned function, beside the scenario")


def files_of(effect: object) -> dict[str, str]:
    """Returns the fields of an effect that name files, with the names."""
    fields = dataclasses.fields(effect)  # type: ignore[arg-type]
    names = [f.name for f in fields if f.name == "file" and f.type is str]
    return {name: getattr(effect, name) for name in names if getattr(effect, name)}


def acts_at_joint(effect: type) -> bool:
    """Returns whether an effect has a field that names the joint at which it acts."""
    return any(field.name == "joint" for field in dataclasses.fields(effect))


def amplitudes(effect: type) -> tuple[str, ...]:
    """Returns the names of an effect's parameters that are zero at null."""
    return tuple(f.name for f in _numbers(effect) if not f.metadata["grid"])


def shape_parameters(effect: type) -> dict[str, tuple[float, ...]]:
    """Returns the names of an effect's shape parameters, each with its grid."""
    return {f.name: f.metadata["grid"] for f in _numbers(effect) if f.metadata["grid"]}


def _numbers(effect: type) -> list[dataclasses.Field]:
    return [f for f in dataclasses.fields(effect) if isinstance(f.default, float)]
