"""Quantities that are not SI: millimetres, degrees, and the like."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.logs import Episode, rotation_matrices, sensor_wrench
from sysid.data_checks.expectation import Expectation, FittedExpectation
from sysid.data_checks.finding import DataFinding, Severity
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.models.base import Array
from sysid.models.rate_factors import median_reach, rate_factors
from sysid.parameters import nominal_values

#: Quantities of a log of joint motion, each with the one that is its derivative.
RATES = (("q", "v"), ("v", "vd"))
_GRAVITY = 9.81
_THOUSAND = 1000.0
_DEGREES = 180.0 / np.pi
_REMEDY = "convert it to SI and write the log again"


def log_unit_findings(subject: Subject) -> list[DataFinding]:
    """Finds units that the log itself contradicts, without a prediction."""
    find = {
        "transitions": _transitions,
        "static_wrench": _static_wrench,
        "contact": _static_wrench,
        "joint_motion": _joint_motion,
        "joint_torque_static": _degrees_of_joints,
        "joint_response": _joint_response,
    }
    return find[subject.kind](subject)


def predicted_unit_findings(
    subject: Subject, expected: Expectation
) -> list[DataFinding]:
    """Finds forces and torques that the nominal model expects at another scale."""
    settings, measured = subject.settings, subject.model.measurements
    values = measured.values[expected.rows]
    is_arm = subject.kind in ("joint_motion", "joint_torque_static")
    table = subject.model.frames(expected.rows)[0]
    nominal, values = table.of(expected.nominal), table.of(values)
    noise = np.where(np.isnan(measured.noise), np.inf, measured.noise)
    found = []
    for unit, name in (("N", "forces"), ("N m", "torques")):
        own = [i for i, c in enumerate(measured.channels) if c.unit == unit]
        scale = scale_between(nominal[:, own], values[:, own], settings, noise[own])
        wrong = _unit_findings(f"the scale of the {name}", scale, settings)
        if is_arm:
            wrong = _of_all_joints(wrong, values, expected, settings)
        found += wrong
    return found


def _of_all_joints(
    wrong: Sequence[DataFinding],
    values: Array,
    expected: Expectation,
    settings: DataSettings,
) -> list[DataFinding]:
    """Returns findings of torques' unit (n, joints): refused if it is all joints'.

    A URDF's inertias may be placeholders, but these are not off by one unit's factor
    at each joint of which gravity tells the scale.
    """
    scales = {}
    if isinstance(expected, FittedExpectation):
        scales = gravity_scales(values, expected, settings)
    for factor in (_THOUSAND, 1.0 / _THOUSAND):
        off = [abs(np.log(scale / factor)) for scale in scales.values()]
        if wrong and off and max(off) < np.log(settings.unit_band):
            what = f"the scale of the torques is {np.median(list(scales.values())):.3g}"
            remedy = (
                f"give `scale: {1.0 / factor:g}` of tau in the map of import-log, or "
                "convert it to SI and write the log again"
            )
            what = f"{what} times what it should be at all joints that tell"
            return [DataFinding("units", what, remedy, Severity.REFUSE)]
    return _as_warnings(wrong)


def gravity_scales(
    values: Array, expected: FittedExpectation, settings: DataSettings
) -> dict[int, float]:
    """Returns torques (n, joints) by those that the URDF's masses take.

    By the joint's number, of those at which these show beside friction and an offset.
    """
    scales = {}
    for number in range(values.shape[1]):
        both = np.column_stack([expected.nominal[:, number], values[:, number]])
        own = expected.friction(number)
        both = both - own @ np.linalg.lstsq(own, both, rcond=None)[0]
        norm, size = np.linalg.norm(both, axis=0)
        product = float(both[:, 0] @ both[:, 1])
        if abs(product) > settings.unit_correlation * norm * size:
            scales[number] = abs(product) / norm**2
    return scales


def _transitions(subject: Subject) -> list[DataFinding]:
    """Compares measured and commanded poses with each other, actions, and the task."""
    model, settings = subject.model, subject.settings
    episodes = subject.episodes
    commanded = [e["X_GB_commanded"][:, :3] for e in episodes]
    measured = [e["X_GB_measured"][:, :3] for e in episodes]
    moved = np.concatenate([np.diff(c, axis=0) for c in commanded])
    actions = np.concatenate([e["action"][:-1, :3] for e in episodes])
    turns = np.concatenate([_turns(e) for e in episodes])
    turned = np.concatenate([e["action"][:-1, 3:] for e in episodes])
    scales = {
        "X_GB_measured": scale_between(
            np.concatenate(commanded), np.concatenate(measured), settings
        ),
        "action.dx to dz": scale_between(moved, actions, settings),
        "action.du to dw": scale_between(turns, turned, settings),
    }
    found = []
    for name, scale in scales.items():
        wrong = _unit_findings(name, scale, settings, _DEGREES)
        # The twin replays commanded poses, no actions.
        found += wrong if name == "X_GB_measured" else _as_warnings(wrong)
    reach = float(np.abs(np.concatenate(commanded)).max())
    scenario = model.scenario_at(nominal_values(model.parameters))
    if scenario is not None:
        travel = scenario.part.reach
        if reach > settings.pose_reach * travel:
            what = f"X_GB_commanded reaches {reach:.3g} m, the bolt travels {travel} m"
            found.append(_finding(what))
    return found + _as_warnings(_degrees_of_joints(subject))


def _turns(episode: Episode) -> Array:
    """Returns the rotation vectors (rows - 1, 3) between commanded orientations."""
    R = rotation_matrices(episode["X_GB_commanded"][:, 3:])
    step = np.einsum("nij,nkj->nik", R[1:], R[:-1])
    vee = [step[:, i, j] - step[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))]
    return 0.5 * np.column_stack(vee)  # of small turns


def _static_wrench(subject: Subject) -> list[DataFinding]:
    """Looks at the mass and the lever that readings of a load imply."""
    settings, found = subject.settings, []
    parts = [(log, e) for log in subject.logs for e in log.episodes]
    wrench = np.concatenate([sensor_wrench(log.header, e) for log, e in parts])
    down = np.concatenate([-rotation_matrices(e["R_WS"])[:, 2] for _, e in parts])
    force, torque = (part - part.mean(axis=0) for part in np.hsplit(wrench, 2))
    down = down - down.mean(axis=0)
    size, turned = np.linalg.norm(force), np.linalg.norm(down)
    if not size or not turned:
        return []
    weight = float(np.sum(force * down) / turned**2)
    agrees = abs(weight) * turned > settings.unit_correlation * size
    if agrees and weight < 0.0:
        what = f"the readings' weight is {weight:.3g} N: it pulls up"
        remedy = "turn their signs: wrench is what the load exerts on the sensor"
        found.append(DataFinding("axes", what, remedy, Severity.REFUSE))
    if abs(weight) > settings.greatest_payload * _GRAVITY:
        found.append(_finding(f"the readings' weight is {weight:.3g} N"))
    lever = float(np.linalg.norm(torque) / size)
    if agrees and lever > settings.longest_lever:
        what = f"the torques are {lever:.3g} m times the forces"
        found.append(_finding(f"{what}: N mm, or kN?"))
    return found


def _joint_motion(subject: Subject) -> list[DataFinding]:
    """Compares v and vd with derivatives of q and v, of all joints and one by one."""
    found = _degrees_of_joints(subject)
    time = np.concatenate([e["time"] for e in subject.episodes])
    counts = [e.rows for e in subject.episodes]
    episode = np.repeat(np.arange(len(counts)), counts)
    for of, by in RATES:
        if of not in subject.episodes[0] or by not in subject.episodes[0]:
            continue
        values, rates = (
            np.concatenate([e[name] for e in subject.episodes]) for name in (of, by)
        )
        factors = [
            factor.value if factor.is_off(0.0) else np.nan
            for factor in rate_factors(time, episode, values, rates)
        ]
        name = f"{by}, beside the derivative of {of},"
        wrong = _wrong_rate(name, _common(factors), subject.settings)
        found += wrong
        for i, factor in enumerate(factors if not wrong else ()):
            name = f"{by}.{i}, beside the derivative of {of}.{i},"
            found += _wrong_rate(name, factor, subject.settings)
    return found


def _common(factors: Sequence[float]) -> float:
    """Returns the median of factors that are known; NaN if none is."""
    known = [factor for factor in factors if np.isfinite(factor)]
    return float(np.median(known)) if known else np.nan


def _wrong_rate(name: str, factor: float, settings: DataSettings) -> list[DataFinding]:
    """Returns findings of a rate's unit and sign, by its factor; NaN for unknown."""
    wrong = _unit_findings(name, factor, settings, _DEGREES)
    return wrong + sign_findings(name, factor, settings)


def _joint_response(subject: Subject) -> list[DataFinding]:
    """Compares measured positions with commanded ones, joint by joint."""
    settings = subject.settings
    found = _degrees_of_joints(subject)
    changes = [
        [e[name] - e[name].mean(axis=0) for e in subject.episodes]
        for name in ("q_commanded", "q")
    ]
    commanded, measured = (np.concatenate(part) for part in changes)
    for i in range(commanded.shape[1]):
        scale = scale_between(commanded[:, [i]], measured[:, [i]], settings)
        name = f"q.{i}, beside q_commanded.{i},"
        found += _unit_findings(name, scale, settings, _DEGREES)
        found += sign_findings(name, scale, settings)
    return found


def derivatives(subject: Subject, of: str, by: str) -> tuple[Array, Array]:
    """Returns the derivative of a quantity, and what the log has of it (n, joints).

    Of all episodes, by central differences; (0, 0) if the log has not both.
    """
    episodes = [e for e in subject.episodes if of in e and by in e and e.rows > 2]
    if not episodes:
        return np.zeros((0, 0)), np.zeros((0, 0))
    slopes = [np.gradient(e[of], e["time"], axis=0) for e in episodes]
    return np.concatenate(slopes), np.concatenate([e[by] for e in episodes])


def _degrees_of_joints(subject: Subject) -> list[DataFinding]:
    """Finds joint positions that most joints of no arm reach."""
    if "q" not in subject.episodes[0]:
        return []
    q = np.concatenate([e["q"] for e in subject.episodes])
    most = median_reach(q)
    if most <= subject.settings.most_turn:
        return []
    what = f"half of the joints are beyond q = {most:.3g}: degrees, or millimetres?"
    remedy = f"give `unit: deg` (or mm) of q in the map of import-log, or {_REMEDY}"
    return [DataFinding("units", what, remedy, Severity.REFUSE)]


def scale_between(
    expected: Array,
    measured: Array,
    settings: DataSettings,
    noise: Array | float = np.inf,
) -> float:
    """Returns the factor between arrays (n, k); NaN if it is not known.

    They must correlate, or else what was measured be far larger than noise (k,).
    """
    both = float(np.sum(expected * measured))
    norm, size = float(np.linalg.norm(expected)), float(np.linalg.norm(measured))
    if norm == 0.0:
        return np.nan
    if abs(both) > settings.unit_correlation * norm * size:
        return both / norm**2
    most = np.hypot(norm, np.linalg.norm(noise * np.ones_like(expected)))
    is_huge = size * settings.unit_band > _THOUSAND * most
    return float(size / most) if is_huge else np.nan


def _unit_findings(
    name: str, scale: float, settings: DataSettings, *more: float
) -> list[DataFinding]:
    """Returns a finding if a scale is that of a wrong unit.

    Args:
        name: of the quantity.
        scale: what it is times what it should be; NaN for unknown.
        settings: thresholds.
        more: factors of units, in addition to 1000.
    """
    for factor in (_THOUSAND, *more):
        for each in (factor, 1.0 / factor):
            if np.abs(np.log(np.abs(scale) / each)) < np.log(settings.unit_band):
                what = f"{name} is {abs(scale):.3g} times what it should be"
                return [_finding(what)]
    return []


def sign_findings(name: str, scale: float, settings: DataSettings) -> list[DataFinding]:
    """Returns a finding if a scale is about -1."""
    if not -settings.unit_band < scale < -1.0 / settings.unit_band:
        return []
    what = f"{name} has the wrong sign"
    return [DataFinding("axes", what, "turn the sign", Severity.REFUSE)]


def _as_warnings(findings: Sequence[DataFinding]) -> list[DataFinding]:
    return [dataclasses.replace(f, severity=Severity.WARN) for f in findings]


def _finding(what: str) -> DataFinding:
    return DataFinding("units", what, _REMEDY, Severity.REFUSE)
