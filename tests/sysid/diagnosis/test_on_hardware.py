"""A diagnosis over the devices' own protocols, in virtual time; holds."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.effects import SensorDrift, SensorMounting, SensorWarmUp
from drake_disasm.experiments import JointExcitation, JointStrokes, Presses, Rest
from drake_disasm.logs import read_log
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.fake_cell.lockstep import FakeHardware, fake_hardware
from sysid.diagnosis import Diagnosis, GrowingArmLog, arm_of_station, diagnose
from tests.refusals import refused

MODEL = load_scenario("removal", ["contact.model=impact"])
WIDE = {"workspace_low": [-0.5] * 3, "workspace_high": [0.5] * 3}
EFFECTS = (SensorDrift, SensorWarmUp, SensorMounting)


def _back_at_a(fake: FakeHardware, most: int) -> Callable[[str], bool]:
    """Returns what a person does before each experiment: brings the bolt back to A."""
    left = iter([True] * most)

    def confirm(_: str) -> bool:
        fake.jog_to_start()
        return next(left, False)

    return confirm


def _diagnose(fake: FakeHardware, folder: Path, most: int = 20) -> Diagnosis:
    return diagnose(
        MODEL,
        folder,
        station=lambda _: fake.station,
        real=fake.station.scenario,
        experiments=(Presses, Rest),
        effects=EFFECTS,
        confirm=_back_at_a(fake, most),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect", [SensorMounting(ry=0.15), SensorWarmUp(fz=3.0, time_constant=12.0), None]
)
def test_it_ends_with_what_the_cell_hides(effect, tmp_path) -> None:
    hidden = [effect] if effect else []
    with fake_hardware("removal", hidden=hidden) as fake:
        found = _diagnose(fake, tmp_path)
    assert found.names == tuple(type(each).__name__ for each in hidden)
    assert not found.closed.verdict.ambiguous


@pytest.mark.slow
def test_an_arm_moves_within_the_limits_that_hold_hardware(tmp_path) -> None:
    """Its workspace lets the bolt out of the part, and its joints move a quarter."""
    with fake_hardware("removal", limits=WIDE) as fake:
        arm, space, header = arm_of_station(
            fake.station, fake.station.scenario, tmp_path
        )
        log = GrowingArmLog(arm, space, header, tmp_path)
        for experiment in (JointExcitation(10.0), JointStrokes(0.1, 6.0, 1)):
            plan = experiment.plan(space)
            assert np.ptp(plan.motion.q, axis=0).max() > 0.05
            assert log.perform(plan).ended == ""
            log.refuse_hold()
    assert log.episodes == 2


def test_a_hold_keeps_the_rows_and_the_next_start_goes_on(tmp_path) -> None:
    hidden = [SensorWarmUp(fz=30.0, time_constant=2.0)]  # the robot runs away from it
    with fake_hardware("removal", hidden=hidden) as fake, refused("is held"):
        _diagnose(fake, tmp_path)
    held = read_log(tmp_path / "log").episodes
    assert len(held) < 3 and len(held[-1].columns["time"]) > 3
    with (
        fake_hardware("removal", limits={"max_force": 1.0}) as fake,
        refused("is not performed", "of what is allowed"),
    ):
        _diagnose(fake, tmp_path)
    with fake_hardware("removal") as fake, refused("stopped by hand"):
        _diagnose(fake, tmp_path, most=1)
    episodes = read_log(tmp_path / "log").episodes
    assert len(episodes) == len(held) + 1
