"""A motion on the hardware station with fake devices: its guards are in force."""

import numpy as np
import pytest

from drake_disasm.free_motion import way
from drake_disasm.free_motion.playing import MotionPlayer
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.fake_cell.lockstep import fake_hardware
from drake_disasm.stations.hardware import HoldError
from tests.drake_disasm.free_motion.test_playing import MOTION

_WIDE = {"workspace_low": [-0.5] * 3, "workspace_high": [0.5] * 3}
_SLOWLY = MotionTable(4.0 * MOTION.time, MOTION.q)


def test_the_workspace_holds_an_arm_that_lifts_the_bolt_beyond_it(monkeypatch) -> None:
    monkeypatch.setattr(way, "_IN_PART", 0.06)
    with fake_hardware(load_scenario("removal")) as fake:
        player = MotionPlayer(fake.station, MOTION)
        with pytest.raises(HoldError, match="workspace"):
            player.play()
        assert not len(player.columns()["time"])


@pytest.mark.slow
def test_it_is_played_where_the_configuration_leaves_room() -> None:
    with fake_hardware(load_scenario("removal"), limits=_WIDE) as fake:
        player = MotionPlayer(fake.station, _SLOWLY)
        player.play()
        columns = player.columns()
    assert columns["time"][-1] == pytest.approx(6.0, abs=0.02)
    assert np.abs(columns["q"] - columns["q_commanded"]).max() < 0.03
