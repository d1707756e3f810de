"""Torques of an arm that are none of its joints: amperes, or another channel's."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.data_checks.expectation import Expectation, FittedExpectation
from sysid.data_checks.finding import DataFinding
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.data_checks.units import gravity_scales
from sysid.models.base import Array

_SURROGATES = 39  # of which a channel of its joint is above all but two, 95 %
_PIECES = 16  # of the log, in another order in each of these
_PLACED = 0.95


def torque_findings(subject: Subject, expected: Expectation) -> list[DataFinding]:
    """Finds torques of another scale than the URDF's, or that show no motion."""
    if not isinstance(expected, FittedExpectation) or not subject.is_of_joints:
        return []
    measured = subject.model.measurements
    names = [channel.name for channel in measured.channels]
    values = measured.values[expected.rows]
    found = _of_another_scale(names, values, expected, subject.settings)
    # At rest friction depends on the motion before, which no row knows.
    is_motion = subject.kind == "joint_motion"
    if is_motion and len(values) > subject.settings.dead_channel_rows:
        found += _of_another_joint(names, values, expected, subject.settings)
    return found


def _of_another_scale(
    names: Sequence[str],
    values: Array,
    expected: FittedExpectation,
    settings: DataSettings,
) -> list[DataFinding]:
    """Compares torques (n, joints) with what the URDF's masses take.

    All of them must be off in the same way: single links of a URDF may be placeholders.
    """
    scales = {
        names[number]: scale
        for number, scale in gravity_scales(values, expected, settings).items()
    }
    if not scales:
        return []
    low, high = min(scales.values()), max(scales.values())
    if high * settings.unit_band > 1.0 and low < settings.unit_band:
        return []
    what = (
        f"torques are {low:.2g} to {high:.2g} times what the URDF's masses take "
        f"({', '.join(scales)}): motor currents [A], or another arm's URDF?"
    )
    remedy = "give the motor constants [N m/A] as `scale` in the map, or the arm's URDF"
    return [DataFinding("units", what, remedy)]


def _of_another_joint(
    names: Sequence[str],
    values: Array,
    expected: FittedExpectation,
    settings: DataSettings,
) -> list[DataFinding]:
    """Finds torques that their joint's motion does not explain.

    It explains them no better than pieces of them in another order (block surrogates,
    since the motion may repeat itself), or far less than another joint's torque does.
    """
    centred = values - values.mean(axis=0)
    size = np.linalg.norm(centred, axis=0)
    correlation = np.abs(centred.T @ centred) / np.maximum(np.outer(size, size), 1e-300)
    np.fill_diagonal(correlation, 0.0)
    orders = _orders(len(values))
    # A model of known bodies has them in no column.
    spans = [
        np.linalg.qr(np.column_stack([expected.columns(n), expected.nominal[:, n]]))[0]
        for n in range(len(names))
    ]
    whole = np.maximum(size**2, 1e-300)
    explained = np.array(
        [
            np.sum((Q.T @ torque) ** 2)
            for Q, torque in zip(spans, centred.T, strict=True)
        ]
    )
    found = {}
    for number in np.flatnonzero(size > 0.0).tolist():
        best = int(np.argmax(correlation[number]))
        moved = centred[orders, number]
        by_chance = np.sum((spans[number].T @ moved) ** 2, axis=0)
        own, other = (explained / whole)[[number, best]]
        copied = 1.0 - correlation[number, best] ** 2
        if np.mean(by_chance < explained[number]) < _PLACED:
            found[names[number]] = "nothing"
        elif own < other and copied < settings.explained**2 * (1.0 - own):
            found[names[number]] = f"that of {names[best]}"
    if not found:
        return []
    words = ", ".join(f"of {name} {motion}" for name, motion in found.items())
    what = f"torques show another motion than their joint's: {words}"
    remedy = "look whether the channel is this joint's, and whether it is alive"
    return [DataFinding("unrelated", what, remedy)]


def _orders(rows: int) -> NDArray[np.int64]:
    """Returns the rows' numbers with pieces in other orders (rows, surrogates)."""
    pieces = np.array_split(np.arange(rows), _PIECES)
    random = np.random.default_rng(0)
    orders = [random.permutation(_PIECES) for _ in range(_SURROGATES)]
    found = [np.concatenate([pieces[i] for i in order]) for order in orders]
    return np.stack(found, axis=1)
