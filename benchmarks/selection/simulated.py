"""Simulated recordings of arms: a Fourier motion and torques with hidden effects."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.logs.importing.importer import processing_origin
from drake_disasm.logs.importing.processing import ImportProcessing, process
from drake_disasm.logs.importing.recording import Recording
from selection.answer import Case
from selection.hidden import Truth, hide, hide_at_all_joints
from selection.noise import UNMODELLED, drawn_noise
from sysid.models.base import LogModel
from sysid.models.joint_motion import JointMotionModel

Array = NDArray[np.float64]

#: Effects of the library that show in an arm's torques.
ARM_KINDS = (
    *("JointCoulombFriction", "JointViscousFriction", "JointStribeckFriction"),
    *("JointAsymmetricFriction", "JointLoadFriction", "JointQuadraticFriction"),
    *("TorqueOffset", "TorqueGain", "RotorInertia", "TorqueRipple", "JointCoupling"),
    *("ArmDelay", "JointDelay", "ArmTilt", "JointElasticity", "JointBacklash"),
)
_COMMON = "JointCoulombFriction"  # what every real arm has at all its joints
#: Joints of an arm and length of its recording [s].
ARMS = ((2, 25.0), (3, 20.0), (4, 15.0), (6, 12.0), (7, 10.0))
CUTOFFS = (3.0, 6.0, 12.0)  # Hz, of the import's filter
PERIOD = 0.01  # s
_NOISE = 0.02  # of a torque's rms
_LEAST_NOISE = 0.002  # of the largest torque's rms
_URDF_OFF = 0.1  # by which the device's base parameters are off the URDF's
_AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0", "0 1 0")
_HARMONICS = (0.1, 0.2, 0.3, 0.5)  # Hz, about
_REACH = 0.35  # rad, of a harmonic of the lowest frequency
_QUANTUM = 1e-5  # rad, of an encoder


@dataclasses.dataclass(frozen=True)
class Plan:
    """What a simulated recording is to be like.

    Attributes:
        name, group, noise: of the case.
        kinds: classes of effects to hide, in the order in which they are tried; one
            tuple for each effect.
        level: size of each effect, see `Truth.size`.
        seed: of everything that is drawn.
        joints, seconds: of the arm and its recording.
        cutoff: of the import's filter [Hz]; None writes exact motion.
        leaves_out: whether the library lacks the effects' classes.
        at_all_joints: whether dry friction acts at all joints, too.
    """

    name: str
    group: str
    noise: str
    kinds: tuple[tuple[str, ...], ...]
    level: float
    seed: int
    joints: int = 3
    seconds: float = 20.0
    cutoff: float | None = None
    leaves_out: bool = False
    at_all_joints: bool = False


@dataclasses.dataclass(frozen=True)
class Motion:
    """A recording's motion: time (n,), and q, v, vd (n, joints)."""

    time: Array
    q: Array
    v: Array
    vd: Array


def write_arm_case(plan: Plan, folder: Path) -> Case:
    """Writes the recordings of a plan; returns the case."""
    random = np.random.default_rng(plan.seed)
    urdf = _write_urdf(folder / "arm.urdf", plan.joints)
    motions = [fourier(random, plan.joints, plan.seconds) for _ in range(2)]
    clean = [folder / name for name in ("clean", "clean_held_out")]
    for path, motion in zip(clean, motions, strict=True):
        _write(path, urdf, motion, np.zeros_like(motion.q))
    models = [JointMotionModel([read_log(path)]) for path in clean]
    truth = _hidden(plan, _device(models[0], random), random)
    logs = []
    for name, motion, model in zip(("log", "held_out"), motions, models, strict=True):
        noise = _noise(plan, motion, random) * truth.noise * _as_filtered(plan.cutoff)
        tau = truth.on(model) + noise
        logs.append(folder / name)
        origin: dict[str, Any] = {}
        if plan.cutoff:
            _, noise, _ = _imported(motion, noise, plan.cutoff)
            motion, tau, origin = _imported(motion, tau, plan.cutoff)
        _write(logs[-1], urdf, motion, tau, origin)
    return Case(
        plan.name,
        (str(logs[0]),),
        plan.group,
        plan.noise,
        (str(logs[1]),),
        str(urdf),
        truth.hidden,
        truth.values,
        tuple({n.partition(".")[0] for n in truth.hidden}) if plan.leaves_out else (),
        plan.level,
        least_error=float(np.linalg.norm(noise) / np.linalg.norm(tau)),
    )


def fourier(random: np.random.Generator, joints: int, seconds: float) -> Motion:
    """Returns a motion of a few harmonics, which repeats nothing.

    Args:
        random: draws sizes and phases.
        joints, seconds: of the motion.
    """
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    q, v, vd = np.zeros((3, len(time), joints))
    for about in _HARMONICS:
        omega = 2.0 * np.pi * max(1, round(about * seconds)) / seconds
        size = random.normal(0.0, _REACH * (_HARMONICS[0] / about) ** 0.5, joints)
        phase = omega * time[:, None] + random.uniform(0.0, 2.0 * np.pi, joints)
        q += size * np.sin(phase)
        v += size * omega * np.cos(phase)
        vd -= size * omega**2 * np.sin(phase)
    return Motion(time, q, v, vd)


def _device(model: LogModel, random: np.random.Generator) -> Truth:
    """Returns an arm whose bodies differ from the URDF's by some per cent."""
    nominal = np.array([p.nominal for p in model.parameters])
    theta = nominal * (1.0 + _URDF_OFF * random.standard_normal(len(nominal)))
    size = np.sqrt(np.mean(model.predictions(theta) ** 2, axis=0))
    noise = np.maximum(_NOISE * size, _LEAST_NOISE * size.max())
    return Truth.of(model, theta, noise)


def _hidden(plan: Plan, truth: Truth, random: np.random.Generator) -> Truth:
    for kinds in plan.kinds:
        truth = hide(truth, kinds, plan.level, random)
    if plan.at_all_joints:
        truth = hide_at_all_joints(truth, _COMMON, plan.level, random)
    return truth


def _noise(plan: Plan, motion: Motion, random: np.random.Generator) -> Array:
    """Returns noise (n, joints) of about unit variance."""
    if plan.noise != UNMODELLED:
        return drawn_noise(plan.noise, random, *motion.q.shape)
    white = drawn_noise("white", random, *motion.q.shape)
    own = np.random.default_rng([plan.seed, 1])  # the same on both recordings
    return (white + unmodelled(own, motion)) / np.sqrt(2.0)


def unmodelled(random: np.random.Generator, motion: Motion) -> Array:
    """Returns torques (n, joints) that no library has, of about unit variance.

    Each joint's friction and load vary with its angle, and its neighbour's, in waves
    of a tenth of a turn to a whole one, as worn gears and cables make them.

    Args:
        random: draws waves.
        motion: on which they act.
    """
    q, v = motion.q, motion.v
    neighbour = np.roll(q, 1, axis=1)
    torque = np.zeros_like(q)
    for factor in (np.ones_like(q), np.tanh(v / 0.05), v / v.std(axis=0)):
        for _ in range(3):
            waves = random.uniform(1.0, 10.0, q.shape[1])
            cross = random.uniform(-1.0, 1.0, q.shape[1])
            phase = random.uniform(0.0, 2.0 * np.pi, q.shape[1])
            torque += factor * np.sin(waves * q + cross * neighbour + phase)
    return np.asarray(torque / np.sqrt(np.mean(torque**2, axis=0)))


def _as_filtered(cutoff: float | None) -> float:
    """Returns how much larger white noise has to be to be as large after a filter."""
    return 1.0 if cutoff is None else float(np.sqrt(0.5 / (cutoff * PERIOD)))


def _imported(
    motion: Motion, tau: Array, cutoff: float
) -> tuple[Motion, Array, dict[str, Any]]:
    """Returns a recording of positions and torques, as the importer makes it.

    And its provenance, which says how it was filtered.
    """
    q = np.round(motion.q / _QUANTUM) * _QUANTUM
    recorded = Recording("run", motion.time, {"q": q, "tau": tau})
    [part], done = process([recorded], ImportProcessing(cutoff))
    columns = part.columns
    time = columns["time"] - columns["time"][0]
    origin = {"import": {"processing": processing_origin(done)}}
    found = Motion(time, columns["q"], columns["v"], columns["vd"])
    return found, columns["tau"], origin


def _write(
    folder: Path,
    urdf: Path,
    motion: Motion,
    tau: Array,
    origin: Mapping[str, Any] | None = None,
) -> None:
    joints = joint_names(motion.q.shape[1])
    origin = {"source": "benchmarks/selection/judge.py", **(origin or {})}
    header = LogHeader(
        "joint_motion", "excite", origin, joints=joints, urdf=str(urdf), period=PERIOD
    )
    table = {
        "time": motion.time,
        "q": motion.q,
        "v": motion.v,
        "vd": motion.vd,
        "tau": tau,
    }
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", table))


def joint_names(count: int) -> tuple[str, ...]:
    """Returns the names of an arm's joints."""
    return tuple(f"joint_{i + 1}" for i in range(count))


def _write_urdf(path: Path, joints: int) -> Path:
    """Writes a serial arm; one of two joints swings in a vertical plane."""
    axes = _AXES[1:3] if joints == 2 else _AXES[:joints]
    parts = ['<robot name="arm"><link name="base"/>']
    parts += [_joint(i, axis) for i, axis in enumerate(axes)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([*parts, "</robot>\n"]))
    return path


def _joint(number: int, axis: str) -> str:
    """Returns a joint and its link, lighter and shorter the farther from the base."""
    mass, length = 6.0 * 0.7**number, 0.35 * 0.9**number
    inertia, height = mass * length**2 / 12.0, 0.0 if number == 0 else length / 0.9
    parent = f"link_{number}" if number else "base"
    return f"""<link name="link_{number + 1}"><inertial>
<origin xyz="0.02 0.01 {length / 2.0:.5f}"/><mass value="{mass:.5f}"/>
<inertia ixx="{inertia:.6f}" ixy="0" ixz="0" iyy="{inertia:.6f}" iyz="0"
 izz="{0.2 * inertia:.6f}"/></inertial></link>
<joint name="joint_{number + 1}" type="revolute"><parent link="{parent}"/>
<child link="link_{number + 1}"/><origin xyz="0 0 {height:.5f}"/><axis xyz="{axis}"/>
<limit lower="-6.3" upper="6.3" velocity="10" effort="500"/></joint>"""


def arm_plans(seeds: Sequence[int], prefix: str = "") -> list[Plan]:
    """Returns the plans of arms' recordings, for each of some seeds."""
    plans: list[Plan] = []
    for seed in seeds:
        plans += [*_singles(seed, prefix), *_several(seed, prefix)]
        plans += [*_nulls(seed, prefix), *_left_out(seed, prefix)]
        plans += _unmodelled_plans(seed, prefix)
    return plans


def _singles(seed: int, prefix: str) -> list[Plan]:
    from_noise = ("white", "ar0.9", "ar0.98", "t3", "residual")
    found = []
    for i, kind in enumerate(ARM_KINDS):
        for j, level in enumerate((1.0, 2.0, 5.0)):
            noise = from_noise[(i + 2 * j) % 5]
            joints, seconds = ARMS[(i + j + seed) % 5]
            name = f"{prefix}joint/one/{level:g}x/{noise}/{kind}_{seed}"
            own = (_from(i),)
            made = Plan(name, "one", noise, own, level, _seed(seed, i, j))
            found.append(dataclasses.replace(made, joints=joints, seconds=seconds))
        found.append(_filtered(i, seed, prefix))
    return found


def _filtered(i: int, seed: int, prefix: str) -> Plan:
    """Returns a plan with the import's filter in the loop, at twice the noise."""
    joints, seconds = ARMS[(i + seed) % 4]
    name = f"{prefix}filter/one/2x/white/{ARM_KINDS[i]}_{seed}"
    return Plan(
        name, "one", "white", (_from(i),), 2.0, _seed(seed, i, 3),
        joints, seconds, CUTOFFS[i % 3],
    )  # fmt: skip


def _several(seed: int, prefix: str) -> list[Plan]:
    found = []
    for i, noise in enumerate(("white", "ar0.9", "ar0.98", "t3", "residual")):
        for j, level in enumerate((1.0, 2.0, 5.0)):
            number = 3 * i + j
            joints, seconds = ARMS[(i + j + seed) % 5]
            kinds = tuple(_from(number + 5 * k) for k in range(3))
            is_common = bool(number % 2)
            name = f"{prefix}joint/three/{level:g}x/{noise}/{number}_{seed}"
            plan = Plan(
                name, "three", noise, kinds[: 2 if is_common else 3], level,
                _seed(seed, 20 + i, j), joints, seconds, at_all_joints=is_common,
            )  # fmt: skip
            found.append(plan)
    return found


def _nulls(seed: int, prefix: str) -> list[Plan]:
    found = []
    for i, noise in enumerate(("white", "ar0.9", "ar0.98", "t3", "residual")):
        for j, (joints, seconds) in enumerate(ARMS):
            name = f"{prefix}joint/null/{noise}/{joints}_{seed}"
            made = Plan(name, "null", noise, (), 0.0, _seed(seed, 30 + i, j))
            found.append(dataclasses.replace(made, joints=joints, seconds=seconds))
    for j, cutoff in enumerate(CUTOFFS):
        joints, seconds = ARMS[j]
        name = f"{prefix}filter/null/white/{joints}_{seed}"
        made = Plan(name, "null", "white", (), 0.0, _seed(seed, 40, j), cutoff=cutoff)
        found.append(dataclasses.replace(made, joints=joints, seconds=seconds))
    return found


def _left_out(seed: int, prefix: str) -> list[Plan]:
    found = []
    for i, kind in enumerate(ARM_KINDS):
        noise = ("white", "ar0.9", "residual")[i % 3]
        joints, seconds = ARMS[(i + seed) % 5]
        name = f"{prefix}joint/left out/5x/{noise}/{kind}_{seed}"
        made = Plan(name, "left out", noise, (_from(i),), 5.0, _seed(seed, 50, i))
        made = dataclasses.replace(made, joints=joints, seconds=seconds)
        found.append(dataclasses.replace(made, leaves_out=True))
    return found


def _unmodelled_plans(seed: int, prefix: str) -> list[Plan]:
    """Returns plans of arms that do what no library has, too."""
    found = []
    for i, (joints, seconds) in enumerate(ARMS * 4):
        level = (0.0, 0.0, 2.0, 5.0)[i // len(ARMS)]
        kinds = (_from(3 * i),) if level else ()
        group, own = "one" if level else "null", _seed(seed, 60, i)
        size = f"{level:g}x/" if level else ""
        name = f"{prefix}unmodelled/{group}/{size}{joints}_{i}_{seed}"
        plan = Plan(name, group, UNMODELLED, kinds, level, own, joints, seconds)
        found.append(plan)
    return found


def _from(number: int) -> tuple[str, ...]:
    """Returns all kinds in their order, from one on."""
    first = number % len(ARM_KINDS)
    return ARM_KINDS[first:] + ARM_KINDS[:first]


def _seed(seed: int, i: int, j: int) -> int:
    return 57_001 + 10_000 * seed + 100 * i + j
