"""Sample logs: a header and one episode's columns for each kind."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.logs import LogHeader, LogWriter, flat_columns

_EFFECTS = {"effects": [{"name": "friction", "mu": 0.15}], "seed": 3}
_ORIGIN = {"program": "test", "seed": 3}
_URDF = "package://arm/arm.urdf"
_DRIVE = {"limit": 1.0, "gravity_compensation": True}
SAMPLE_HEADERS = {
    header.kind: header
    for header in (
        LogHeader("transitions", "lock", _ORIGIN, period=0.1, scenario=_EFFECTS),
        LogHeader("static_wrench", "weigh", {"sensor": "a"}, frames={"wrench": "W"}),
        LogHeader("contact", "press", {}, frames={"wrench": "S"}),
        LogHeader("joint_motion", "excite", {}, {}, 0.01, ("a", "b", "c"), _URDF),
        LogHeader("joint_torque_static", "hold", {}, joints=("a", "b"), urdf=_URDF),
        LogHeader("joint_response", "swing", {}, {}, None, ("a", "b"), _URDF, _DRIVE),
    )
}

# Doubles that a careless text format changes.
AWKWARD = (0.1, -0.0, 5e-324, 1.7976931348623157e308, 1 / 3, 1e22, 123456789.123456789)


def _poses(rng: np.random.Generator, rows: int) -> np.ndarray:
    quaternions = rng.normal(size=(rows, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    return np.hstack([rng.normal(size=(rows, 3)), quaternions])


def _transitions(rng: np.random.Generator, rows: int) -> dict[str, Any]:
    action = rng.normal(size=(rows, 6))
    action[-1] = 0.0
    reward = np.append(rng.normal(size=rows - 1), 0.0)
    return {
        "time": 0.1 * np.arange(rows),
        "X_GB_measured": _poses(rng, rows),
        "X_GB_commanded": _poses(rng, rows),
        "wrench": rng.normal(size=(rows, 6)),
        "action": action,
        "action_executed": 2.0 * action,
        "ft_sensor": rng.normal(size=(rows, 6)),
        "q": rng.normal(size=(rows, 7)),
        "reward.distance": reward,
        "reward.force": -reward,
        "terminated": np.arange(rows) == rows - 1,
        "truncated": np.zeros(rows, dtype=bool),
    }


def _static_wrench(rng: np.random.Generator, rows: int) -> dict[str, Any]:
    awkward = rng.normal(size=rows)
    awkward[: len(AWKWARD)] = AWKWARD[:rows]
    return {
        "order": np.arange(rows, dtype=float),
        "R_WS": _poses(rng, rows)[:, 3:],
        "wrench": rng.normal(size=(rows, 6)),
        "extra.awkward": awkward,
        "extra.temperature": 20.0 + rng.normal(size=rows),
    }


def _contact(rng: np.random.Generator, rows: int) -> dict[str, Any]:
    return {
        "time": 0.1 * np.arange(rows),
        "R_WS": _poses(rng, rows)[:, 3:],
        "wrench": rng.normal(size=(rows, 6)),
        "free": (np.arange(rows) < 3).astype(float),
    }


def _joint_motion(rng: np.random.Generator, rows: int) -> dict[str, Any]:
    names = ("q", "v", "vd", "tau")
    motion = {name: rng.normal(size=(rows, 3)) for name in names}
    return {"time": 1.5e9 + 0.01 * np.arange(rows), **motion}


def _joint_torque_static(rng: np.random.Generator, rows: int) -> dict[str, Any]:
    values = {name: rng.normal(size=(rows, 2)) for name in ("q", "tau")}
    return {"order": np.arange(rows, dtype=float), **values}


def _joint_response(rng: np.random.Generator, rows: int) -> dict[str, Any]:
    names = ("q_commanded", "q", "gain", "supply", "enabled", "current")
    motion = {name: rng.normal(size=(rows, 2)) for name in names}
    return {"time": 0.005 * np.arange(rows), **motion}


SAMPLES = {
    "transitions": _transitions,
    "static_wrench": _static_wrench,
    "contact": _contact,
    "joint_motion": _joint_motion,
    "joint_torque_static": _joint_torque_static,
    "joint_response": _joint_response,
}


@pytest.fixture
def headers() -> dict[str, LogHeader]:
    """A valid header of each kind."""
    return SAMPLE_HEADERS


@pytest.fixture
def sample() -> Callable[..., dict[str, np.ndarray]]:
    """`sample(kind, seed=0, rows=12)`: valid columns of an episode."""

    def make(kind: str, seed: int = 0, rows: int = 12) -> dict[str, np.ndarray]:
        vectors = SAMPLES[kind](np.random.default_rng(seed), rows)
        return flat_columns(kind, vectors)

    return make


@pytest.fixture
def written(tmp_path, headers, sample):
    """`written(kind, file_format, episodes=1)`: the folder of a sample log."""

    def write(kind: str, file_format: str = "csv", episodes: int = 1) -> Path:
        with LogWriter(tmp_path / kind, headers[kind], file_format) as writer:
            for seed in range(episodes):
                writer.write_episode(sample(kind, seed))
        return tmp_path / kind

    return write
