"""Simulated logs of the cell's transitions, with hidden effects; minutes each."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drake_disasm.effects import (
    Effect,
    amplitudes,
    registered_effects,
    shape_parameters,
)
from selection.answer import Case
from sysid.validation.blind_tests import nominal, residual
from sysid.validation.random_effects import random_effect
from sysid.validation.synthetic_logs import transitions_log

#: Effects of the library that show in transitions of the twin.
CELL_KINDS = (
    *("GroovePose", "GrooveBend", "GrooveClearance", "GrooveFriction"),
    *("GrooveViscousFriction", "GrooveStribeckFriction", "RustyPatch", "ChainPull"),
    *("CommandGain", "MotionLag", "Backlash", "Compliance", "BoltSlip", "PoseDelay"),
    *("SensorDrift", "SensorStep", "SensorGain", "SensorCrossTalk", "SensorLag"),
    *("SensorDelay", "SensorHysteresis", "SensorSaturation", "SensorMounting"),
    *("PayloadError", "BaseTilt"),
)
_RHO = 0.9


@dataclasses.dataclass(frozen=True)
class Plan:
    """What a simulated log of transitions is to be like.

    Attributes:
        name, group, noise: of the case; the noise is "white" or "ar0.9".
        kinds: classes of effects to hide.
        level: rms of what each leaves, in units of the noise.
        seed: of everything that is drawn.
        leaves_out: whether the library lacks the effects' classes.
    """

    name: str
    group: str
    noise: str
    kinds: tuple[str, ...]
    level: float
    seed: int
    leaves_out: bool = False


def write_cell_case(plan: Plan, folder: Path) -> Case:
    """Writes the log of a plan and another one to hold out; returns the case."""
    random = np.random.default_rng(plan.seed)
    known = {effect.__name__: effect for effect in registered_effects()}
    probes = folder / "probes"
    probes.mkdir(parents=True)
    effects = [
        random_effect(known[k], random, plan.level, lambda e: residual(e, str(probes)))
        for k in plan.kinds
    ]
    rho = _RHO if plan.noise == "ar0.9" else 0.0
    for i, name in enumerate(("log", "held_out")):
        transitions_log(
            folder / name, nominal(), effects, plan.seed + 50 * i, correlation=rho
        )
    return Case(
        plan.name,
        (str(folder / "log"),),
        plan.group,
        plan.noise,
        (str(folder / "held_out"),),
        hidden=plan.kinds,
        values=dict(pair for effect in effects for pair in _values(effect)),
        left_out=plan.kinds if plan.leaves_out else (),
        level=plan.level,
    )


def _values(effect: Effect) -> list[tuple[str, float]]:
    kind = type(effect)
    fields = (*amplitudes(kind), *shape_parameters(kind))
    return [(f"{kind.__name__}.{f}", float(getattr(effect, f))) for f in fields]


def cell_plans(seeds: Sequence[int], prefix: str = "") -> list[Plan]:
    """Returns the plans of logs of the cell, for each of some seeds."""
    found, count = [], len(CELL_KINDS)
    for seed in seeds:
        first = 57_001 + 10_000 * seed + 4_000_000
        for i, kind in enumerate(CELL_KINDS):
            for level in (2.0, 5.0):
                own = first + 100 * i + int(level)
                name = f"{prefix}cell/one/{level:g}x/white/{kind}_{seed}"
                found.append(Plan(name, "one", "white", (kind,), level, own))
        for i in range(0, count, 3):
            name, own = f"{prefix}cell/three/5x/white/{i}_{seed}", first + 3000 + i
            kinds = tuple(CELL_KINDS[(i + 8 * k) % count] for k in range(3))
            found.append(Plan(name, "three", "white", kinds, 5.0, own))
            kind, own = CELL_KINDS[i], first + 4000 + i
            name = f"{prefix}cell/left out/5x/white/{kind}_{seed}"
            found.append(Plan(name, "left out", "white", (kind,), 5.0, own, True))
        for i in range(10):
            noise, own = ("white", "ar0.9")[i % 2], first + 5000 + i
            name = f"{prefix}cell/null/{noise}/{i}_{seed}"
            found.append(Plan(name, "null", noise, (), 0.0, own))
    return found
