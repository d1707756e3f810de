"""Simulated readings of a force/torque sensor at rest, with hidden effects."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from drake_disasm.logs import read_log, write_static_wrench
from selection.answer import Case
from selection.hidden import Truth, hide
from selection.noise import NOISES, drawn_noise
from sysid.models.base import LogModel
from sysid.models.from_logs import ModelChoice, model_of

Array = NDArray[np.float64]

#: Effects of the library that show in readings at rest.
SENSOR_KINDS = (
    *("SensorDrift", "SensorWarmUp", "SensorStep", "SensorGain", "SensorGainDrift"),
    *("SensorCrossTalk", "SensorSaturation", "SensorDeadBand", "SensorMounting"),
    "BaseTilt",
)
_NOISE = np.array([0.05] * 3 + [0.002] * 3)  # N, N m
_POSES, _ROWS, _EACH = 100, 900, 30  # readings; rows, and how many of them in a pose
_PERIOD = 0.1  # s, of the rows of a sensor that stands still by turns
_LOAD = {
    "mass": (0.6, 1.5),  # kg
    "c": (-0.08, 0.08),  # kg m
    "f": (-3.0, 3.0),  # N
    "t": (-0.2, 0.2),  # N m
}


@dataclasses.dataclass(frozen=True)
class Plan:
    """What simulated readings are to be like.

    Attributes:
        name, group, noise: of the case.
        kinds: classes of effects to hide, in the order in which they are tried; one
            tuple for each effect.
        level: size of each effect, see `Truth.size`.
        seed: of everything that is drawn.
        rows: 100 poses, or 900 rows of a sensor that stands still by turns.
        leaves_out: whether the library lacks the effects' classes.
    """

    name: str
    group: str
    noise: str
    kinds: tuple[tuple[str, ...], ...]
    level: float
    seed: int
    rows: int = _POSES
    leaves_out: bool = False


def write_sensor_case(plan: Plan, folder: Path) -> Case:
    """Writes the readings of a plan; returns the case."""
    random = np.random.default_rng(plan.seed)
    poses = [_poses(plan, random) for _ in range(2)]
    models = [
        _write(folder / f"clean_{i}", pose, np.zeros((plan.rows, 6)))
        for i, pose in enumerate(poses)
    ]
    truth = Truth.of(models[0], _load(models[0], random), _NOISE)
    for kinds in plan.kinds:
        truth = hide(truth, kinds, plan.level, random)
    names = ("log", "held_out")
    for name, pose, model in zip(names, poses, models, strict=True):
        noise = drawn_noise(plan.noise, random, plan.rows, 6) * _NOISE
        wrench = truth.on(model) + noise
        _write(folder / name, pose, wrench)
    return Case(
        plan.name,
        (str(folder / "log"),),
        plan.group,
        plan.noise,
        (str(folder / "held_out"),),
        hidden=truth.hidden,
        values=truth.values,
        left_out=truth.hidden if plan.leaves_out else (),
        level=plan.level,
        least_error=float(np.linalg.norm(noise) / np.linalg.norm(wrench)),
    )


def _poses(plan: Plan, random: np.random.Generator) -> Array:
    """Returns orientations (rows, 4) [qw, qx, qy, qz]."""
    count = plan.rows if plan.rows == _POSES else plan.rows // _EACH
    turned = Rotation.random(count, random_state=int(random.integers(2**31)))
    return np.repeat(turned.as_quat()[:, [3, 0, 1, 2]], plan.rows // count, axis=0)


def _load(model: LogModel, random: np.random.Generator) -> Array:
    """Returns a load and a bias: the model's parameters (p,)."""
    fields = [p.name.rpartition(".")[2] for p in model.parameters]
    ranges = [_LOAD[f] if f in _LOAD else _LOAD[f[0]] for f in fields]
    return np.array([random.uniform(*limits) for limits in ranges])


def _write(folder: Path, R_WS: Array, wrench: Array) -> LogModel:
    time = None if len(R_WS) == _POSES else np.arange(len(R_WS)) * _PERIOD
    origin = {"source": "benchmarks/selection/judge.py"}
    write_static_wrench(folder, R_WS, wrench, "S", "weigh", origin, time)
    return model_of([read_log(folder)], ModelChoice())


def sensor_plans(seeds: Sequence[int], prefix: str = "") -> list[Plan]:
    """Returns the plans of readings, for each of some seeds."""
    return [
        plan
        for seed in seeds
        for rows in (_POSES, _ROWS)
        for plan in (*_hidden_plans(seed, rows, prefix), *_nulls(seed, rows, prefix))
    ]


def _hidden_plans(seed: int, rows: int, prefix: str) -> list[Plan]:
    found, head = [], f"{prefix}static{rows}"
    for i, kind in enumerate(SENSOR_KINDS):
        for j, level in enumerate((1.0, 2.0, 5.0)):
            noise = NOISES[(i + 2 * j) % len(NOISES)]
            name = f"{head}/one/{level:g}x/{noise}/{kind}_{seed}"
            own = _seed(seed, rows, i, j)
            found.append(Plan(name, "one", noise, (_from(i),), level, own, rows))
    for i, noise in enumerate(NOISES):
        level = (1.0, 2.0, 5.0)[i % 3]
        kinds = tuple(_from(i + 3 * k) for k in range(3))
        name, own = f"{head}/three/{level:g}x/{noise}/{i}_{seed}", 20 + i
        found.append(
            Plan(name, "three", noise, kinds, level, _seed(seed, rows, own, 0), rows)
        )
    for i in range(0, len(SENSOR_KINDS), 2):
        noise, own = NOISES[i // 2], _seed(seed, rows, 50, i)
        name = f"{head}/left out/5x/{noise}/{SENSOR_KINDS[i]}_{seed}"
        kinds = (_from(i),)
        found.append(Plan(name, "left out", noise, kinds, 5.0, own, rows, True))
    return found


def _nulls(seed: int, rows: int, prefix: str) -> list[Plan]:
    return [
        Plan(
            f"{prefix}static{rows}/null/{noise}/{k}_{seed}",
            "null", noise, (), 0.0, _seed(seed, rows, 30 + i, k), rows,
        )
        for i, noise in enumerate(NOISES)
        for k in range(4)
    ]  # fmt: skip


def _from(number: int) -> tuple[str, ...]:
    """Returns all kinds in their order, from one on."""
    first = number % len(SENSOR_KINDS)
    return SENSOR_KINDS[first:] + SENSOR_KINDS[:first]


def _seed(seed: int, rows: int, i: int, j: int) -> int:
    return 57_001 + 10_000 * seed + 1_000_000 * (1 + (rows == _ROWS)) + 100 * i + j
