"""A motion that is played on the simulated cell: the way to it, and its log."""

from collections.abc import Iterator

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from drake_disasm.common.progress import ProgressUpdate
from drake_disasm.effects import JointCoulombFriction
from drake_disasm.free_motion import way
from drake_disasm.free_motion.playing import MotionPlayer
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.free_motion.way import with_way
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation, TwinStation
from tests.refusals import refusal

_TIME = np.linspace(0.0, 1.5, 301)
_POSTURE = np.array([0.0, 0.2, 0.0, -1.4, 0.0, 1.2, 0.0])
_SWING = 0.15 * (1.0 - np.cos(2.0 * np.pi * _TIME / 1.5))  # rad
MOTION = MotionTable(_TIME, _POSTURE - _SWING[:, None] * np.eye(7)[[1, 3]].sum(axis=0))


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The way takes two seconds, not ten."""
    for name, speed in (("_IN_PART", 0.15), ("_OUT", 0.5), ("_TURN", 1.0)):
        monkeypatch.setattr(way, name, speed)
    monkeypatch.setattr(way, "_REST", 0.1)
    yield


def cell(*effects: object) -> CellStation:
    scenario = load_scenario("removal", ["gripper.hold=weld"])
    scenario.effects = list(effects)
    return CellStation(scenario)


def test_the_way_leaves_the_groove_along_it_and_then_upwards(hasty: None) -> None:
    station = cell()
    whole, begin = with_way(station, MOTION)
    before = whole.q[whole.time < begin]
    p = np.array([station.coordinates.pose(q).translation() for q in before])
    end = station.scenario.part.stages[0].end
    in_groove = p[: int(np.argmax(p[:, 1] > 1e-4))]
    assert in_groove[-1, 0] == pytest.approx(end, abs=1e-4)
    np.testing.assert_allclose(in_groove[:, 1:], 0.0, atol=1e-4)
    assert p[:, 1].max() >= 0.99 * way._HEIGHT
    np.testing.assert_allclose(whole.q[whole.time >= begin - 1e-9], MOTION.q)
    assert (np.diff(whole.time) > 0.0).all()


def test_its_log_has_the_motion_alone_and_shows_the_arms_friction(hasty: None) -> None:
    lag = {}
    for name, effects in (
        ("free", ()),
        ("rubbing", (JointCoulombFriction(joint="iiwa_joint_4", size=8.0),)),
    ):
        player = MotionPlayer(cell(*effects), MOTION)
        seen: list[ProgressUpdate] = []
        player.play(progress=seen.append)
        assert seen[-1].done == seen[-1].total == round(player.end)
        columns = player.columns()
        assert columns["time"][0] == pytest.approx(0.0, abs=1e-9)
        assert columns["time"][-1] == pytest.approx(1.5, abs=player.period)
        commanded = np.stack(
            [np.interp(columns["time"], _TIME, column) for column in MOTION.q.T], axis=1
        )
        np.testing.assert_allclose(columns["q_commanded"], commanded, atol=0.01)
        lag[name] = columns["q_commanded"] - columns["q"]
        assert np.abs(lag[name]).max() < 0.02
    more = np.abs(lag["rubbing"] - lag["free"]).max(axis=0)
    assert more[3] > 3.0 * more[0]


def test_a_motion_that_is_stopped_on_the_way_has_no_rows(hasty: None) -> None:
    player = MotionPlayer(cell(), MOTION)

    def interrupt(update: ProgressUpdate) -> None:
        if update.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        player.play(progress=interrupt)
    assert not len(player.columns()["time"])


def test_what_shows_the_cell_joins_the_diagram(hasty: None) -> None:
    shown = []

    def add_view(builder: DiagramBuilder, station: object) -> None:
        shown.append((builder, station))

    station = cell()
    MotionPlayer(station, MOTION, add_view)
    assert shown[0][1] is station
    twin = TwinStation(load_scenario("removal"))
    assert "no arm" in refusal(MotionPlayer, twin, MOTION)
