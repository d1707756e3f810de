"""Small inputs of the programs: logs, recordings, a policy's file, a verdict."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from drake_disasm.effects import CommandGain
from drake_disasm.learning.run import write_episodes
from drake_disasm.logs import (
    LogHeader,
    LogWriter,
    flat_columns,
    write_static_wrench,
)
from drake_disasm.mdp import Outcome
from drake_disasm.policies import (
    LearnedPolicy,
    Network,
    PolicyDescription,
    TaskView,
    save_policy,
)
from drake_disasm.scenario import dump_scenario, load_scenario
from drake_disasm.task.episode import EpisodeSummary
from sysid.acceptance.corrected_twin import refused_verdict

SLIDE = """<robot name="slide"><link name="bed"/>
  <link name="carriage"><inertial><mass value="95"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="bed"/><child link="carriage"/>
    <axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="400"/></joint>
  <transmission name="screw"><type>transmission_interface/SimpleTransmission</type>
    <joint name="slide"/><actuator name="motor"/></transmission>
</robot>
"""


def slide_motion() -> dict[str, np.ndarray]:
    """Returns time, q, v, vd, tau (n,) of a carriage of 95 kg with dry friction."""
    random, time = np.random.default_rng(0), 0.005 * np.arange(3000)
    w = 2.0 * np.pi * np.array([0.3, 0.7, 1.1])[:, None]
    q, v = 0.05 * np.sin(w * time).sum(0), 0.05 * (w * np.cos(w * time)).sum(0)
    vd = -0.05 * (w**2 * np.sin(w * time)).sum(0)
    tau = 95.0 * vd + 20.0 * np.tanh(v / 0.02) + random.standard_normal(len(time))
    return {"time": time, "q": q, "v": v, "vd": vd, "tau": tau}


def write_slide_log(folder: Path, **changes: np.ndarray) -> Path:
    """Writes a joint_motion log of it, with slide.urdf beside it; returns its folder.

    Args:
        folder: of the log.
        changes: columns in place of its own.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    urdf = folder.parent / "slide.urdf"
    urdf.write_text(SLIDE)
    header = LogHeader("joint_motion", "move", {}, joints=("slide",), urdf=str(urdf))
    columns = slide_motion() | changes
    arrays = {n: a if n == "time" else a[:, None] for n, a in columns.items()}
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", arrays))
    return folder


def write_readings(folder: Path, seed: int = 0) -> Path:
    """Writes a static_wrench log of 1.2 kg on a sensor with a bias; returns its folder.

    Args:
        folder: of the log.
        seed: of orientations and noise.
    """
    R = Rotation.random(15, random_state=seed)
    g_S = R.inv().apply([0.0, 0.0, -9.81])
    wrench = np.hstack([1.2 * g_S, np.cross([0, 0, 0.06], g_S)])
    wrench += [1, 2, 3, 0, 0.1, 0]
    wrench += 0.005 * np.random.default_rng(seed).normal(size=wrench.shape)
    quaternions = R.as_quat()[:, [3, 0, 1, 2]]
    return write_static_wrench(folder, quaternions, wrench, "S", "w", {})


def write_policy(path: Path, period: float = 0.1) -> None:
    """Writes a network of one layer as a policy's file, for scenario `removal`."""
    network = Network((np.ones((6, 12), np.float32),), (np.ones(6, np.float32),))
    description = PolicyDescription(
        period=period, max_translation=0.001, max_rotation=0.0087266
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    save_policy(
        path, LearnedPolicy(network, TaskView(np.ones(12), np.ones(6)), description)
    )


def write_trainings(*folders: Path) -> None:
    """Writes what trainings of three seeds leave behind for their learning curves."""
    outcomes = [Outcome.FORCE_LIMIT] * 6 + [Outcome.SUCCESS] * 6
    for folder in folders:
        for seed in range(3):
            own = folder / f"seed_{seed:03d}"
            own.mkdir(parents=True)
            episodes = [
                EpisodeSummary(
                    i, reward_terms={"progress": float(i * seed)}, outcome=outcome
                )
                for i, outcome in enumerate(outcomes)
            ]
            write_episodes(own / "episodes.csv", episodes)


#: A task of 3 mm in 4 steps of 1 mm, for which an arm that falls short is too slow.
_SHORT = ("task.success=travelled", "task.travel_success=0.003", "task.steps=4")


def write_closed(folder: Path, gain: float = -0.1, **changes: Any) -> Path:
    """Writes what close-loop does for an arm that falls short; returns the folder.

    `straight` does the task up to a `CommandGain.x` of -0.25; the interval is from -0.5
    to 0.

    Args:
        folder: of the output.
        gain: the verdict's value.
        changes: entries of `result.json` in place of its own; `...` leaves one out.
    """
    folder.mkdir(parents=True, exist_ok=True)
    scenario = load_scenario("removal", _SHORT)
    scenario = dataclasses.replace(scenario, effects=[CommandGain(x=gain)])
    (folder / "scenario.yaml").write_text(dump_scenario(scenario))
    of_gain = {"value": gain, "unit": "1", "interval_95": [-0.5, 0.0]}
    result = refused_verdict("") | {
        "ending": "explained",
        "sentence": "The model lacks a gain error of the commands.",
        "ties": {"CommandGain": {}},
        "parameters": {"CommandGain.x": of_gain | {"is_at_bound": False}},
    }
    kept = {k: v for k, v in {**result, **changes}.items() if v is not ...}
    (folder / "result.json").write_text(json.dumps(kept))
    return folder
