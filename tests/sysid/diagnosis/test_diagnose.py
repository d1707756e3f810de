"""A station finds out what its model lacks: simulated, few effects, IMPACT contact."""

import dataclasses
import html
from pathlib import Path
from typing import cast

import pytest

from drake_disasm.effects import (
    GrooveBend,
    GroovePose,
    Reach,
    RustyPatch,
    SensorBias,
    SensorDrift,
    SensorGain,
    SensorWarmUp,
)
from drake_disasm.experiments import Presses, Removal, Rest, Reversals
from drake_disasm.logs import read_log
from drake_disasm.scenario import Scenario, load_scenario
from sysid.diagnosis import NOTHING, Budget, GrowingLog, diagnose
from sysid.diagnosis.loop import Round, refuted_names, why_refuted
from sysid.diagnosis.rivals import TwinRival, open_rivals, slower, twin_rival
from sysid.diagnosis.unseen import unseen_rivals
from sysid.models.twin import with_impact_as_stiff
from sysid.report import diagnosis_page
from sysid.workers import Workers
from tests.refusals import refused

FEW = {
    "effects": (SensorDrift, SensorWarmUp, SensorGain),
    "experiments": (Presses, Reversals, Rest),
}
IMPACT = load_scenario("removal", ["contact.model=impact"])


def _real(*effects: object) -> Scenario:
    return dataclasses.replace(IMPACT, effects=list(effects))


def _removal_from_cell(hidden: object, folder: Path) -> GrowingLog:
    """Returns a removal's log: of a cell with an effect, its model has none."""
    cell = load_scenario("removal")
    known, real = (
        with_impact_as_stiff(cell),
        dataclasses.replace(cell, effects=[hidden]),
    )
    log = GrowingLog(known, folder, real=real)
    log.perform(Removal().plan(known))
    return log


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("warm")
    real = _real(SensorWarmUp(fz=2.0, time_constant=15.0))
    found = diagnose(IMPACT, folder, station="twin", real=real, **FEW)
    return folder, real, found


def test_it_ends_with_what_is_hidden(warm) -> None:
    folder, _, found = warm
    assert found.is_settled and found.names == ("SensorWarmUp",)
    assert found.reason == "settled: the model lacks SensorWarmUp"
    assert found.robot_time < 300.0
    assert found.rounds[-2].names == found.names  # it stood once
    episodes = read_log(folder / "log").episodes
    performed = [each for each in found.rounds if each.experiment]
    assert len(episodes) == 3 + len(performed)
    for each in performed:
        assert each.force < 14.0 and each.distance > 4.0 and len(each.rivals) > 1
        assert set(each.predicted) == set(each.rivals)


def test_verdicts_are_refuted_of_which_no_name_is_left() -> None:
    one, two = ("A",), ("B", "C")
    assert refuted_names([one], one) == ()
    assert refuted_names([one], two) == ("A",)
    assert refuted_names([()], one) == ()
    assert refuted_names([one, two, one], ("B",)) == ("A",)
    assert refuted_names([one, two, ("C", "B")], ("D",)) == ("A", "B and C")
    assert refuted_names([("A", "B"), ("A", "C"), one], ("D",)) == ("A and B",)


def test_the_report_tells_the_story(warm) -> None:
    page = html.unescape(diagnosis_page(warm[2], {"program": "test"}))
    assert "settled: the model lacks SensorWarmUp" in page
    assert all(each.experiment in page for each in warm[2].rounds)
    assert "(episode_0003)" in page
    watched = diagnosis_page(warm[2], {}, is_watched=True)
    assert '<a href="meshcat/episode_0003.html">' in watched


def test_a_second_call_performs_nothing_more(warm) -> None:
    folder, real, first = warm
    again = diagnose(IMPACT, folder, station="twin", real=real, **FEW)
    assert again.robot_time == first.robot_time and again.reason == first.reason
    with refused("another reality"):
        diagnose(IMPACT, folder, station="twin", real=_real(), **FEW)
    with refused("resume with the same header"):
        diagnose(load_scenario("iiwa_peg"), folder, station="twin")


def test_nothing_is_found_where_nothing_is_hidden(tmp_path: Path) -> None:
    found = diagnose(
        IMPACT,
        tmp_path,
        station="twin",
        budget=Budget(60.0),
        **FEW,
    )
    assert found.names == () and not found.closed.verdict.ambiguous
    assert found.is_settled and found.reason.endswith(NOTHING)


def test_a_hypothesis_may_be_slower_than_a_log_shows(tmp_path: Path) -> None:
    """What settles within an experiment to come is a drift until then."""
    real = _real(SensorWarmUp(fy=-2.0, time_constant=40.0))
    log = GrowingLog(IMPACT, tmp_path, station="twin", real=real)
    log.perform(Removal().plan(IMPACT))
    closed, model = log.verdict((SensorDrift, SensorWarmUp)), log.model()
    assert closed.verdict.names == ("SensorDrift",)
    found = open_rivals(closed, model, twin_rival, Workers())
    slow = next(rival for rival in found if rival.name == "SensorWarmUp")
    [effect] = cast(TwinRival, slow).scenario.effects
    slowest = SensorWarmUp.greatest_shapes(model.reach)["time_constant"]
    assert cast(SensorWarmUp, effect).time_constant > slowest


def test_what_is_wider_than_a_log_shows_is_not_made_narrower() -> None:
    reach = Reach(duration=10.0, way=1e-4, speed=0.01)
    warm, patch = SensorWarmUp(fy=1.0, time_constant=1e3), RustyPatch(coefficient=0.1)
    assert slower(patch, reach) == patch
    assert slower(warm, reach) == warm
    slow = SensorWarmUp.greatest_shapes(reach)["time_constant"]
    [quick, longer] = (
        cast(SensorWarmUp, slower(SensorWarmUp(time_constant=own), reach))
        for own in (0.5 * slow, slow)
    )
    assert quick.time_constant == 0.5 * slow and longer.time_constant > slow


def test_what_the_models_own_error_may_be_stays_a_hypothesis(tmp_path: Path) -> None:
    """A slight bend is not named; that nothing is missing can't be said, either."""
    log = _removal_from_cell(GrooveBend(kz=-0.05), tmp_path)
    closed = log.verdict((GrooveBend, GroovePose))
    assert closed.verdict.names == ()
    found = {rival.name: rival for rival in unseen_rivals(closed, log, Workers(), None)}
    assert set(found) == {NOTHING, "GrooveBend", "GroovePose"}
    [bend] = found["GrooveBend"].scenario.effects
    assert cast(GrooveBend, bend).kz == pytest.approx(-0.05, abs=0.02)


def test_what_is_there_and_not_in_the_library_asks_for_nothing_else(
    tmp_path: Path,
) -> None:
    """Effects too small to be seen could not be what the log shows."""
    real = _real(SensorDrift(fy=-0.05))
    log = GrowingLog(IMPACT, tmp_path, station="twin", real=real)
    log.perform(Removal().plan(IMPACT))
    closed = log.verdict((GrooveBend,))
    assert closed.verdict.ending == "unexplained"
    assert unseen_rivals(closed, log, Workers(), None) == ()


def test_names_that_leave_more_each_time_are_not_pursued(tmp_path: Path) -> None:
    """Which of them comes nearest to what the library lacks is no question."""
    log = _removal_from_cell(SensorDrift(fx=-0.1), tmp_path)
    closed = log.verdict((SensorGain,))
    before = Round("", ("SensorGain",), {}, leaves_more=False)
    after = dataclasses.replace(before, leaves_more=True)
    assert "not in the library" in why_refuted((before, after, after), closed)
    assert why_refuted((before, after), closed) == ""
    assert why_refuted((after, after, before), closed) == ""


def test_a_person_may_say_no_and_a_budget_may_be_too_small(tmp_path: Path) -> None:
    asked: list[str] = []

    def no(question: str) -> bool:
        asked.append(question)
        return False

    with refused("stopped by hand"):
        diagnose(IMPACT, tmp_path / "no", station="twin", confirm=no, **FEW)
    assert "Removal" in asked[0]
    with refused("budget", "before the first verdict", "about"):
        diagnose(IMPACT, tmp_path / "few", station="twin", budget=Budget(1.0))
    assert not list((tmp_path / "few" / "log").glob("*.parquet"))


def test_the_first_recording_is_run_on_the_twin_before(tmp_path: Path) -> None:
    weak = load_scenario("removal", ["contact.model=impact", "task.reward.f_max=1"])
    with refused("Removal", "is not performed", "under the model as it is"):
        diagnose(weak, tmp_path, station="twin", **FEW)
    assert not list((tmp_path / "log").glob("*.parquet"))


def test_a_name_that_leaves_more_than_noise_is_not_what_it_lacks(
    tmp_path: Path,
) -> None:
    """A bias comes nearest to a warm-up that the library lacks."""
    hidden = SensorWarmUp(fz=3.0, time_constant=12.0)
    found = diagnose(
        IMPACT,
        tmp_path,
        real=dataclasses.replace(load_scenario("removal"), effects=[hidden]),
        effects=(SensorBias,),
        experiments=(Rest,),
    )
    assert found.closed.verdict.confirmed == ("SensorBias",)
    assert found.names == () and not found.is_settled
    assert "what comes nearest, SensorBias" in found.reason
