"""tools/identify.py: what it writes, and how it refuses bad input."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.logs import LogWriter, read_log
from drake_disasm.scenario import load_scenario
from tests.tools.inputs import write_readings
from tests.tools.programs import assert_one_line, interrupt, run_program

QUICK = ("--budget", "60", "--workers", "1")


def run(*arguments: object, name: str = "identify") -> subprocess.CompletedProcess[str]:
    return run_program(name, *arguments)


@pytest.fixture(scope="module")
def readings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two static logs of a 1.2 kg load on a sensor with a bias, with noise."""
    folder = tmp_path_factory.mktemp("readings")
    for number in range(2):
        write_readings(folder / f"log_{number}", seed=number)
    return folder


@pytest.fixture(scope="module")
def transitions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log that states `removal` and was made on a groove with more friction."""
    folder = tmp_path_factory.mktemp("transitions")
    hidden = folder / "hidden.yaml"
    hidden.write_text(
        "name: hidden\neffects:\n"
        "- !GrooveFriction {coefficient: 0.1}\n- !GroovePose {ry: 0.02}\n"
    )
    done = run(
        "--station", "twin", "--no-meshcat", "--policy", "admittance",
        "--explore", 0.15,
        "--episodes", 3, "--hidden", hidden, "--set", "task.steps=14",
        "--set", "contact.model=impact",  # an evaluation takes a fourteenth
        "--record", folder / "log", name="simulate",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    header = read_log(folder / "log").header
    assert header.scenario and header.scenario["effects"] == []
    assert header.provenance["explore_mm"] == 0.15
    return folder / "log"


def test_readings_at_rest_from_the_command_line(readings: Path, tmp_path: Path) -> None:
    out = tmp_path / "fit"
    logs = (readings / "log_0", readings / "log_1")
    done = run("--log", *logs, "--held-out", "log_1", "--out", out, *QUICK)
    assert done.returncode == 0, done.stderr
    assert "bees and nlopt agree" in done.stdout
    result = json.loads((out / "result.json").read_text())
    low, high = result["derived"]["weight"]["interval_95"]
    assert low - 0.01 < 1.2 * 9.81 < high + 0.01
    assert result["objective"]["held_out"]["episodes"] == ["log_1/episode_0000"]
    assert result["objective"]["held_out"]["after"] < 1.5
    assert result["provenance"]["data"][str(logs[0])] == read_log(logs[0]).data_hash
    assert "<img" in (out / "report.html").read_text()
    assert load_scenario(str(out / "scenario.yaml")).effects


@pytest.mark.slow
def test_a_twin_from_the_command_line_and_back_into_simulate(
    transitions: Path, tmp_path: Path
) -> None:
    """The hidden friction and turn are found, and the scenario runs as it is."""
    bounds = tmp_path / "bounds.yaml"
    bounds.write_text(
        "contact.friction: {low: 0.1, high: 0.5}\n"
        "GroovePose.ry: {low: 0.0, high: 0.04}\n"
    )
    out = tmp_path / "fit"
    done = run(
        "--log", transitions, "--parameters", bounds, "--out", out,
        "--method", "nlopt", "--budget", 30, "--workers", 2,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads((out / "result.json").read_text())["parameters"]
    assert found["contact.friction"]["value"] == pytest.approx(0.3, rel=0.05)
    assert found["GroovePose.ry"]["value"] == pytest.approx(0.02, rel=0.05)
    scenario = out / "scenario.yaml"
    again = run(
        "--no-meshcat", "--station", "twin", "--scenario", scenario, name="simulate"
    )
    assert again.returncode == 0, again.stderr


@pytest.mark.slow
def test_ctrl_c_leaves_a_state_that_resumes_to_the_same_result(
    transitions: Path, tmp_path: Path
) -> None:
    arguments = (
        "--log", transitions, "--parameters", "contact.friction", "--method", "bees",
        "--preset", "thesis", "--cycles", "2", "--workers", "2",
    )  # fmt: skip
    whole = run(*arguments, "--out", tmp_path / "whole")
    assert whole.returncode == 0, whole.stderr
    out = tmp_path / "fit"
    journal = out / "results.jsonl"

    def is_searching() -> bool:
        return journal.exists() and len(journal.read_text().splitlines()) > 5

    interrupt(is_searching, "identify", *arguments, "--out", out)
    assert not (out / "result.json").exists()
    refused = run(*arguments, "--out", out)
    assert refused.returncode == 2 and "--resume" in refused.stderr
    other = run(*arguments, "--out", out, "--resume", "--seed", 3)
    assert other.returncode == 2 and "another seed" in other.stderr
    again = run(*arguments, "--out", out, "--resume")
    assert again.returncode == 0, again.stderr
    first, second = (
        json.loads((folder / "result.json").read_text())["parameters"]
        for folder in (tmp_path / "whole", out)
    )
    assert first == second


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--parameters", "contact.fricton"), "did you mean 'friction'"),
        (("--objective", "static_wrench"), "transitions or rollout"),
        (("--parameters", "contact.friction", "--set", "part.travel=1"), "--scenario"),
        ((), "--parameters"),
        (  # nobody got as far as the end of the groove
            ("--parameters", "contact.friction", "part.travel", "--workers", "1"),
            "part.travel: has no effect on this log's channels",
        ),
    ],
)
def test_bad_input_is_one_line(
    arguments: tuple[str, ...], message: str, transitions: Path, tmp_path: Path
) -> None:
    done = run("--log", transitions, "--out", tmp_path / "fit", *arguments)
    assert_one_line(done, [message])
    assert not (tmp_path / "fit" / "result.json").exists()


def test_flagged_rows_are_said_and_left_out(readings: Path, tmp_path: Path) -> None:
    source = read_log(readings / "log_0")
    columns = {name: v.copy() for name, v in source.episodes[0].columns.items()}
    columns["time"] = np.arange(len(columns.pop("order")))
    columns["wrench.fx"][:12] = 1.0
    with LogWriter(tmp_path / "log", source.header) as writer:
        writer.write_episode(columns)
    out = tmp_path / "fit"
    done = run("--log", tmp_path / "log", "--drop-flagged-rows", "--out", out, *QUICK)
    assert done.returncode == 0, done.stderr
    assert "data: stuck: wrench.fx" in done.stderr
    assert "12 of 15 rows are left out" in done.stderr
    result = json.loads((out / "result.json").read_text())
    assert result["data_findings"][0]["kind"] == "stuck"
    assert result["objective"]["fitted"]["rows"] == 3
    assert "<b>stuck</b>" in (out / "report.html").read_text()
