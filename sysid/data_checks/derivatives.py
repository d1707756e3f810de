"""Velocities and accelerations that contradict each other, or the arm's limits."""

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs import Episode
from drake_disasm.logs.importing.importer import is_noise
from drake_disasm.logs.importing.signals import unwrapped
from sysid.data_checks.finding import DataFinding, Severity, rows_of
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.models.arm_plant import ArmPlant
from sysid.models.one_joint import is_one_joint

_PAIRS = (
    ("q", "v", "velocities", "positions"),
    ("v", "vd", "accelerations", "velocities"),
)
_ROUNDED = 1e-12  # rad or m: what a filter leaves of a constant
_REMEDY = (
    "leave them out: `drop_flagged_rows`; look at the clock there, and at the ends of "
    "a filter"
)


def derivative_findings(subject: Subject) -> list[DataFinding]:
    """Finds stretches in which derivatives are not those of their columns.

    A clock that hiccups moves all joints by another step of time than the one
    that is written; the ends of a filter bend its derivative.
    """
    if subject.kind != "joint_motion":
        return []
    found = []
    for column, rate, rates, columns in _PAIRS:
        masks = {
            name: _contradicting(episode, column, rate, subject.settings)
            for name, episode in subject.named()
        }
        if rows := rows_of(masks):
            what = f"{rates} are not the derivatives of the {columns} at these rows"
            found.append(DataFinding("derivatives", what, _REMEDY, rows=rows))
    return found + _wraps(subject)


def _wraps(subject: Subject) -> list[DataFinding]:
    """Finds jumps of whole turns in positions: an encoder that wraps."""
    turned = {n: unwrapped(e["time"], e["q"]) for n, e in subject.named()}
    counts = np.sum([count for _, count in turned.values()], axis=0)
    if not counts.any():
        return []
    masks = {
        name: np.abs(np.diff(turned[name][0] - e["q"], axis=0, prepend=0.0)).max(axis=1)
        > np.pi
        for name, e in subject.named()
    }
    names = ", ".join(f"q.{number}" for number in np.flatnonzero(counts))
    what = f"{names} jumps by a whole turn: derivatives of it are wrong there"
    remedy = "import the recording anew, which makes positions continuous"
    return [DataFinding("derivatives", what, remedy, rows=rows_of(masks))]


def stillness_findings(subject: Subject) -> list[DataFinding]:
    """Finds a motion in which no joint moves, or clearly more than its noise.

    What that noise was, a filter hides; the import knows it.
    """
    if subject.kind != "joint_motion":
        return []
    remedy = "record a motion; of readings at rest make a joint_torque_static log"
    if all(np.ptp(e["q"], axis=0).max() < _ROUNDED for e in subject.episodes):
        what = "no joint moves: the log says nothing of inertia and friction"
        return [DataFinding("still", what, remedy, Severity.REFUSE)]
    if not all(is_noise(log.header) for log in subject.logs):
        return []
    what = "no joint moves clearly more than its noise, as the import saw it"
    return [DataFinding("still", what, remedy)]


def limit_findings(subject: Subject) -> list[DataFinding]:
    """Finds speeds and accelerations beyond the limits that the URDF states."""
    model = subject.model
    if subject.kind != "joint_motion" or not model.urdf or is_one_joint(model.urdf):
        return []
    plant = ArmPlant.of(model.urdf, model.joints).plant
    found = []
    for number, name in enumerate(model.joints):
        joint = plant.GetJointByName(name)
        limits = {
            "v": float(joint.velocity_upper_limits()[0]),
            "vd": float(joint.acceleration_upper_limits()[0]),
        }
        for column, limit in limits.items():
            most = float(np.abs(subject.column(f"{column}.{number}")).max())
            if limit > 0.0 and most > limit:
                found.append(f"{column}.{number} ({name}) {most:.3g} of {limit:.3g}")
    if not found:
        return []
    what = f"motion is beyond the limits of the URDF: {', '.join(found)}"
    remedy = "look at the units, the cut-off of the import, and the URDF's limits"
    return [DataFinding("limits", what, remedy)]


def _contradicting(
    episode: Episode, column: str, rate: str, settings: DataSettings
) -> NDArray[np.bool_]:
    """Returns the rows (n,) of stretches that change otherwise than their rates say.

    By the trapezoidal rule over each step, all joints together, in units of what is
    usual between the two: its noise, and the rule's own error.
    """
    bad = np.zeros(episode.rows, dtype=bool)
    if column not in episode or rate not in episode or episode.rows < 3:
        return bad
    values, rates, steps = episode[column], episode[rate], np.diff(episode["time"])
    said = 0.5 * (rates[1:] + rates[:-1]) * steps[:, None]
    error = np.diff(values, axis=0) - said
    floor = 1e-9 * np.ptp(values, axis=0) + 1e-300
    usual = np.maximum(1.4826 * np.median(np.abs(error), axis=0), floor)
    wrong = np.linalg.norm(error / usual, axis=1)
    moved = np.linalg.norm(said / usual, axis=1)
    is_wrong = wrong > settings.derivative_share * moved
    is_wrong &= wrong > settings.derivative_mads * np.sqrt(values.shape[1])
    for begin, end in _runs(is_wrong):
        if end - begin >= settings.derivative_rows:
            bad[begin : end + 1] = True
    return bad


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Returns where a mask (n,) is true: begins, and ends beyond."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
