"""Each example that a program's --help shows is run, as it stands there."""

import importlib
import re
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest
from drake_disasm_cli.main import SUBCOMMANDS

from tests.sysid.monitoring.days import write_day, write_reference
from tests.tools.inputs import (
    SLIDE,
    slide_motion,
    write_closed,
    write_policy,
    write_readings,
    write_slide_log,
    write_trainings,
)
from tests.tools.programs import run_program

#: What makes an example small: later options win over those of the example.
_STEPS = ("--set", "task.steps=3")
_SMALL = {
    "simulate": ("--no-meshcat", "--episodes=1", *_STEPS),
    "evaluate": ("--episodes=1", "--workers=1", *_STEPS),
    "train": ("--episodes=1", "--validation=1", "--eager", "--seeds=1", *_STEPS),
    "study": ("--episodes=1", "--validation=1", "--eager", "--seeds=1", *_STEPS),
    "check-log": ("--workers=1",),
    "identify": ("--budget=4", "--workers=1", "--unidentifiable=freeze"),
    "accept": ("--draws=1", "--workers=1"),
    "close-loop": ("--time-budget=0.01", "--workers=1"),
    "excite": ("--iterations=1", "--duration=4"),
    "play-motion": ("--no-meshcat",),
}
#: Examples that need a cluster, a GPU or devices; some programs run until stopped.
_ELSEWHERE = re.compile(
    r"--executor dask|--device cuda|--station hardware|^drake-disasm fake-cell|--follow"
)
_QUICK = ("plot-training", "accept")
#: A study's own factors, at one level each.
_LEVELS = {
    "precision": ("--levels", "agent=ddpg", "psi=0"),
    "hyperparameters": (
        *("--levels", "batch=100", "tau=0.1"),
        *("actor_rate=0.005", "critic_rate=0.005"),
    ),
}
_TABLE_A1 = """experiment,batch_size,tau,actor_learning_rate,critic_learning_rate,\
performance_1,performance_2,performance_3
1,100,0.1,0.005,0.005,9.17626,16.93363,24.48816
"""
_BOUNDS = "contact.friction: {low: 0.0, high: 0.6}\n"
_POLICY = """
import numpy as np

class Mine:
    def __call__(self, state):
        return np.array([1e-3, 0, 0, 0, 0, 0])
"""
_HIDDEN = "effects: [!JointCoulombFriction {joint: iiwa_joint_4, size: 3.0}]\n"


def examples(name: str) -> list[list[str]]:
    """Returns the examples of a subcommand's help, as words."""
    text = run_program(name, "--help").stdout.partition("example")[2]
    lines = re.sub(r"\\\n\s*", " ", text).splitlines()
    found = [line.strip() for line in lines if line.startswith("  drake-disasm ")]
    return [shlex.split(re.split(r"\s{3,}(?!-)(?!')", line)[0]) for line in found]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with everything that the examples read."""
    monkeypatch.setattr(sys, "path", list(sys.path))  # where a policy's file is
    monkeypatch.delitem(sys.modules, "my_policy", raising=False)  # another example's
    for name in ("out/arm_1", "out/arm_2"):
        write_slide_log(tmp_path / name)
    write_readings(tmp_path / "out/readings")
    columns = slide_motion()
    recorded = {name: columns[name] for name in ("time", "q", "tau")}
    np.savez(tmp_path / "run.npz", **recorded)
    tables = {"run": ("time", "q", "tau"), "q": ("time", "q"), "tau": ("time", "tau")}
    for name, heads in tables.items():
        np.savetxt(
            tmp_path / f"{name}.csv",
            np.stack([recorded[head] for head in heads], 1),
            delimiter=",",
            header=",".join(heads),
            comments="",
        )
    texts = {
        "arm.urdf": SLIDE,
        "arm.yaml": _HIDDEN,
        "bounds.yaml": _BOUNDS,
        "my_policy.py": _POLICY,
        "table_a1.csv": _TABLE_A1,
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def _log_of_the_twin(folder: Path) -> None:
    """Records a log in two episodes of the twin with IMPACT contact."""
    words = "--station twin --policy admittance --explore 0.15 --hidden removal_turned"
    small = "--set task.steps=10 --set contact.model=impact --no-meshcat --episodes 2"
    done = run_program(
        "simulate", *words.split(), *small.split(), "--record=out/log", cwd=folder
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_examples_are_accepted(name: str) -> None:
    module = importlib.import_module(f"drake_disasm_cli.{name.replace('-', '_')}")
    for _, program, *words in examples(name):
        if program == name:
            module.parse(words)  # exits if it is refused


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in _QUICK else pytest.mark.slow)
        for name in SUBCOMMANDS
        if name != "fake-cell"
    ],
)
def test_examples_run(name: str, folder: Path) -> None:
    if name == "plot-training":
        write_trainings(folder / "out/td3", folder / "out/sac")
    if name == "accept":
        write_closed(folder / "out/closed", gain=0.0)
    if name in ("accept", "evaluate"):
        write_policy(folder / "out/first/seed_000/policy.npz")
    if name in ("check-log", "identify", "close-loop"):
        _log_of_the_twin(folder)
    if name == "monitor":
        write_reference(folder / "out")
        write_day(folder / "out/days/day_0", 0)
    ran = 0
    for command in examples(name):
        if _ELSEWHERE.search(shlex.join(command)):
            continue
        _, program, *words = command
        if program == "simulate" and "out/log" in words and name == "identify":
            continue  # the log is there, and small
        small = [*_SMALL.get(program, ()), *_LEVELS.get(words[0] if words else "", ())]
        if name == "identify" and program == "simulate":
            small += ["--station=twin"]  # for IMPACT contact, as in the log
        done = run_program(program, *words, *small, cwd=folder)
        assert done.returncode == 0, (command, done.stderr)
        ran += 1
    assert ran
