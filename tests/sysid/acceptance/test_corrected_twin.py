"""The corrected twin, as close-loop leaves it in a folder."""

from pathlib import Path
from typing import Any

import pytest

from drake_disasm.effects import CommandGain, GroovePose, SensorBias
from drake_disasm.scenario import Scenario, validate
from sysid.acceptance import CorrectedTwin, with_intervals
from tests.refusals import refused
from tests.tools.inputs import write_closed


def test_a_verdict_gives_three_twins(tmp_path: Path) -> None:
    twin = CorrectedTwin.read(write_closed(tmp_path, gain=-0.3))
    assert twin.at_values.effects == [CommandGain(x=-0.3)]
    assert not twin.at_values.randomisation
    [drawn] = twin.over_intervals.randomisation
    assert (drawn.parameter, drawn.low, drawn.high) == ("CommandGain.x", -0.5, 0.0)
    assert twin.nominal.effects == [CommandGain()]
    assert twin.reservations == [] and twin.rivals == {}


def test_the_nominal_twin_keeps_what_the_log_stated(tmp_path: Path) -> None:
    """A stated turn of the groove stays; a tilt that the verdict adds to it goes."""
    folder = write_closed(tmp_path)
    stated = Scenario(effects=[GroovePose(ry=0.02, rz=0.05)])
    value = {"value": 0.05, "unit": "rad", "interval_95": [0.04, 0.06]}
    verdict: dict[str, Any] = dict(CorrectedTwin.read(folder).verdict)
    verdict["parameters"] = {"GroovePose.rz": value}
    twin = CorrectedTwin(stated, verdict)
    assert twin.nominal.effects == [GroovePose(ry=0.02)]


def test_intervals_become_ranges_of_the_effects_that_are_there() -> None:
    ends = {
        "GroovePose.rz": [0.04, 0.06],
        "SensorBias.fx": [1.0, 2.0],  # suggested, and not in the scenario
        "GroovePose.ry": [0.01, 0.01],
    }
    parameters = {name: {"interval_95": each} for name, each in ends.items()}
    twin = with_intervals(Scenario(effects=[GroovePose(rz=0.05)]), parameters)
    assert [(r.parameter, r.low, r.high) for r in twin.randomisation] == [
        ("GroovePose.rz", 0.04, 0.06)
    ]
    validate(twin)
    both = Scenario(effects=[GroovePose(rz=0.05), SensorBias(fx=1.5)])
    assert len(with_intervals(both, parameters).randomisation) == 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"provisional": True}, "time was over"),
        ({"ending": "too short"}, "too short"),
        ({"ending": "unexplained"}, "nothing for sure"),
        ({"ending": "partly"}, "more than noise"),  # by the size of what is left
        ({"ending": "partly", "suggested": ["SensorDrift"]}, "SensorDrift"),
        ({"invalid": "the arm lags"}, "the arm lags"),
        ({"misfits": ["rows 3 to 5 touch"]}, "rows 3 to 5"),
        ({"contradictions": [{"effect": "SensorBias"}]}, "SensorBias"),
        ({"left_in_channels": [{"channel": "tz"}]}, "tz"),
        ({"left_over": [{"channel": "fx"}]}, "fx"),
        ({"suggested": ["SensorDrift"]}, "SensorDrift"),
        ({"residual_model": {"effect": "CellResidualModel"}}, "not physical"),
    ],
)
def test_what_a_verdict_leaves_open_is_said(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    [said] = CorrectedTwin.read(write_closed(tmp_path, **change)).reservations
    assert words in said


def test_rivals_and_values_at_bounds_are_said(tmp_path: Path) -> None:
    value = {"value": -0.5, "unit": "1", "interval_95": [-0.5, 0.0]}
    bound = {"CommandGain.x": value | {"is_at_bound": True}}
    ties = {"CommandGain": {"CommandBacklash": "strokes both ways"}}
    twin = CorrectedTwin.read(write_closed(tmp_path, parameters=bound, ties=ties))
    assert "CommandGain.x" in twin.reservations[0]
    assert twin.rivals == {"CommandGain": ["CommandBacklash"]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"reference": {}}, ("--reference", "close-loop")),
        ({"invalid": ...}, ("lacks 'invalid'", "close-loop")),
        ({"errors": {"channels": {"j1": {}, "j2": {}}}}, ("j1, j2", "transitions")),
        ({"parameters": {"CommandGain.x": {"value": 1.0}}}, ("interval_95",)),
    ],
)
def test_verdicts_of_other_kinds_are_refused(
    change: dict[str, Any], words: tuple[str, ...], tmp_path: Path
) -> None:
    with refused(*words):
        CorrectedTwin.read(write_closed(tmp_path, **change))


def test_folders_that_hold_no_verdict_are_refused(tmp_path: Path) -> None:
    with refused("no result.json", "close-loop"):
        CorrectedTwin.read(tmp_path)
    folder = write_closed(tmp_path)
    (folder / "scenario.yaml").unlink()
    with refused("no scenario.yaml", "close-loop"):
        CorrectedTwin.read(folder)
    text = (folder / "result.json").read_text()
    (folder / "result.json").write_text(text[: len(text) // 2])
    with refused("is damaged", "close-loop"):
        CorrectedTwin.read(folder)
