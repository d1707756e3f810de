"""A pose or a wrench that comes late, and what could be taken for it."""

import pytest

from drake_disasm.effects import (
    Backlash,
    CommandGain,
    Effect,
    MotionLag,
    PoseDelay,
    SensorDeadBand,
    SensorDelay,
)
from drake_disasm.logs import read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.verdict import Verdict
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log

_RIVALS = [PoseDelay, MotionLag, SensorDelay]


def _endings(effect: Effect) -> set[str]:
    """Returns what a verdict may end with where the effect alone is named.

    A pose that is two rows late was never measured as an episode ends: of a stiff bolt
    in contact one row may be off, and is said to be outlying.
    """
    return {"explained", "partly"} if effect == PoseDelay(0.2) else {"explained"}


def _verdict(folder, effects: list[Effect], library=None, episodes=12) -> Verdict:
    log = folder / "log"
    transitions_log(log, nominal(), effects, seed=0, episodes=episodes)
    model = TwinModel([read_log(log)], nominal(), ())
    return close_loop(model, library=library).verdict


def test_a_pose_on_time_is_given_no_delay(tmp_path):
    assert _verdict(tmp_path, [], _RIVALS, episodes=8).ending == "none"


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect",
    [PoseDelay(0.1), Backlash(x=4e-4, z=4e-4)],
    ids=repr,
)
def test_each_is_named_first_of_the_whole_library(effect, tmp_path):
    verdict = _verdict(tmp_path, [effect])
    assert verdict.names == (type(effect).__name__,)
    assert verdict.ending in _endings(effect)


@pytest.mark.slow
def test_a_wrench_that_is_rows_late_is_found_far_from_the_data(tmp_path):
    late = [SensorDelay(0.1)]
    verdict = _verdict(tmp_path, late, [SensorDelay, SensorDeadBand, CommandGain])
    assert (verdict.ending, verdict.names) == ("explained", ("SensorDelay",))
    (value,) = verdict.values
    assert value.value == pytest.approx(0.1, abs=1e-3)
