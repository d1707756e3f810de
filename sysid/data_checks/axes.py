"""Whether other axes, or other signs, would explain a log far better."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drake_disasm.logs.schema import WRENCH
from sysid.data_checks.expectation import Expectation
from sysid.data_checks.finding import DataFinding, Severity
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.data_checks.units import scale_between, sign_findings
from sysid.models.base import Array
from sysid.models.bookkeeping import Frame
from sysid.models.signed_order import SignedOrder
from sysid.models.wrench_bookkeeping import signed_permutations, signed_text

_REMEDY = "exchange the columns, or turn the signs, and write the log again"
_FRAME_COST = 0.1  # the frame of the table is looked at first
_EQUAL = 0.9  # of the least error: explanations that leave less than it / this tie


@dataclass(frozen=True)
class _Change:
    """Other axes that what was measured might have had.

    Attributes:
        text: what they are.
        matrix: (channels, channels) signed permutation.
        frame: in which it acts.
        cost: how much it takes: of changes that explain as much, the cheapest is said.
    """

    text: str
    matrix: Array
    frame: Frame
    cost: float

    def of(self, values: Array) -> Array:
        """Returns measured values (n, channels) with these axes."""
        return self.frame.back(self.frame.of(values) @ self.matrix.T)


@dataclass(frozen=True)
class _Outcome:
    """What a change leaves.

    Attributes:
        change: of the axes.
        left: mean error over all channels, in units of their scale.
        ratio: of the error of the channels that change, to that as it is.
    """

    change: _Change
    left: float
    ratio: float


def axes_findings(subject: Subject, expected: Expectation) -> list[DataFinding]:
    """Finds swapped axes and wrong signs of forces, torques, or joints.

    A signed permutation must lower the mean error of the channels that it moves to a
    fraction, and leave less than most of these channels' size.
    """
    settings = subject.settings
    measured = subject.model.measurements.values[expected.rows]
    if len(measured) < settings.dead_channel_rows:
        return []
    frames = subject.model.frames(expected.rows)
    is_wrench = not subject.is_of_joints
    changes = _wrench_changes(measured.shape[1] - len(WRENCH), frames)
    if not is_wrench:
        changes = _joint_changes(subject, frames[0])
    tried = [_tried(other, measured, expected, settings) for other in changes]
    explaining = [each for each in tried if each.ratio <= settings.explained]
    if not explaining:
        if is_wrench:
            return []
        signs = _all_signs(measured, expected, settings)
        return signs or _exchanged_positions(subject, expected)
    least = min(each.left for each in explaining)
    near = [each for each in explaining if each.left * _EQUAL <= least]
    best = min(near, key=lambda each: each.change.cost)
    what = (
        f"{best.change.text} would explain the readings far better: their error falls "
        f"to {100 * best.ratio:.0f} %"
    )
    return [DataFinding("axes", what, _REMEDY, Severity.REFUSE)]


def _exchanged_positions(subject: Subject, expected: Expectation) -> list[DataFinding]:
    """Finds two joints whose motions are exchanged, of torques much of which is left.

    As other axes do, the exchange must lower the mean error to a fraction.
    """
    model, settings = subject.model, subject.settings
    values = model.measurements.values[expected.rows]
    size = np.mean(np.abs(values - values.mean(axis=0)), axis=0) / expected.scale
    left = np.mean(np.abs(expected.residual(values)), axis=0)
    if not (left > settings.explained * size).any():
        return []
    found = model.exchanged_motions(settings.explained)
    if found is None:
        return []
    (i, j), share = found
    what = (
        f"that q.{i} ({model.joints[i]}) and q.{j} ({model.joints[j]}) are exchanged "
        "would explain the torques far better: their error falls to "
        f"{100 * share:.0f} %"
    )
    remedy = "exchange the columns of q, and of v and vd, in the map of import-log"
    return [DataFinding("axes", what, remedy, Severity.REFUSE)]


def _all_signs(
    measured: Array, expected: Expectation, settings: DataSettings
) -> list[DataFinding]:
    """Returns a finding if all torques (n, joints) have the other sign.

    A fit takes that up, with negative masses; the nominal model does not.
    """
    scales = [
        scale_between(nominal, tau, settings)
        for nominal, tau in zip(expected.nominal.T, measured.T, strict=True)
    ]
    known = [scale for scale in scales if np.isfinite(scale)]
    if not known or max(known) > 0.0:
        return []
    return sign_findings("tau, at all joints that tell,", max(known), settings)


def _tried(
    change: _Change, measured: Array, expected: Expectation, settings: DataSettings
) -> _Outcome:
    """Returns what a change of the axes of measured values (n, channels) leaves.

    The ratio is infinite if it explains nothing either, or something else less: a
    force that is not expected weighs less as one of a channel with more noise.
    """
    turned = change.of(measured)
    size, turned_size = (
        np.mean(np.abs(values - values.mean(axis=0)), axis=0) / expected.scale
        for values in (measured, turned)
    )
    by = np.mean(np.abs(turned - measured), axis=0) / expected.scale
    moved = by > settings.least_change * size
    asis, left = (
        np.mean(np.abs(expected.residual(values)), axis=0)
        for values in (measured, turned)
    )
    ratio = np.inf
    most = settings.explained_share * turned_size[moved].sum()
    explains = left[moved].sum() < most
    if moved.any() and explains and left.sum() < asis.sum():
        ratio = float(left[moved].sum() / asis[moved].sum())
    return _Outcome(change, float(left.mean()), ratio)


def _wrench_changes(first: int, frames: Sequence[Frame]) -> Iterator[_Change]:
    """Yields signed permutations of the forces, of the torques, and of both.

    Args:
        first: number of the channel fx, of which five more follow.
        frames: in each of these.
    """
    count = first + len(WRENCH)
    channels = [""] * first + list(WRENCH)
    for frame, P in itertools.product(frames, signed_permutations()):
        for groups in ((0,), (3,), (0, 3)):
            matrix = np.eye(count)
            for group in groups:
                at = first + group
                matrix[at : at + 3, at : at + 3] = P
            moved = np.flatnonzero((matrix != np.eye(count)).any(axis=1))
            names = [signed_text(channels, matrix, int(i)) for i in moved]
            where = f" ({frame.name})" if frame.name else ""
            # One that acts on forces and torques at once is one cause.
            cost = len(names) / len(groups) + _FRAME_COST * (frame is not frames[0])
            yield _Change(f"{', '.join(names)}{where}", matrix, frame, cost)


def _joint_changes(subject: Subject, frame: Frame) -> Iterator[_Change]:
    """Yields another order or other signs of torques; of positions, single ones."""
    model = subject.model
    known = model.signed_order
    if known is not None:
        if known.steps:
            text = f"that {known.text(model.joints)}"
            yield _Change(text, known.matrix, frame, float(known.steps))
        return
    names = [channel.name for channel in model.measurements.channels]
    for order in SignedOrder.as_written(len(names)).near():
        text = f"that {order.text(names, 'q')}"
        yield _Change(text, order.matrix, frame, float(order.steps))
