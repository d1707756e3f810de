"""Which experiment is chosen, and that it is safe."""

import dataclasses
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from drake_disasm.effects import GroovePose, SensorBias, SensorDrift, SensorWarmUp
from drake_disasm.experiments import Presses, Rest, Reversals
from drake_disasm.scenario import load_scenario
from sysid.diagnosis.design import Forecast, mahalanobis, predict
from sysid.diagnosis.in_contact import twin_forecasts
from sysid.diagnosis.rivals import Need, TwinRival, best_of_folds
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.fitting.settings import DEFAULT_SETTINGS

NEED = Need(25.0)
IMPACT = load_scenario("removal", ["contact.model=impact"])


def rival(name: str, *effects: object, **more: object) -> TwinRival:
    scenario = dataclasses.replace(IMPACT, effects=list(effects))
    return TwinRival(name, 0.5, 0.0, scenario, **more)


def test_a_distance_counts_only_what_parameters_can_not_make_up() -> None:
    away = np.array([3.0, 4.0, 0.0])
    assert mahalanobis(away, np.zeros((0, 3))) == 5.0
    columns = np.array([[100.0, 0.0, 0.0]])
    covariance = np.eye(3) + columns.T @ columns
    expected = np.sqrt(away @ np.linalg.solve(covariance, away))
    assert mahalanobis(away, columns) == pytest.approx(expected, rel=1e-9)
    assert mahalanobis(away, columns) == pytest.approx(4.0, abs=1e-3)


def test_what_the_models_own_error_may_be_is_not_shown() -> None:
    """But where it may be it in one channel, another still shows the rest."""
    plan = Rest(10.0).plan(IMPACT)
    away = np.column_stack([np.full(100, 0.5), np.zeros(100)])
    both = np.column_stack([np.full(100, 0.5), np.full(100, 1.0)])
    share = np.column_stack([np.full(100, 1.0), np.full(100, 0.2)])

    def shown(signal: np.ndarray, need: Need) -> float:
        def forecasts(plans: object, rivals: object) -> list[Forecast]:
            signals = [[np.zeros_like(signal)], [signal]]
            shown = [np.zeros(1)] * 2
            made = Forecast(
                plan, 10.0, (0.0, 0.0), signals, "fx", "N", shown, 0.1, "", share
            )
            return [made]

        (found,) = predict([plan], [rival("one"), rival("other")], need, forecasts)
        return found.farthest

    assert shown(away, Need(25.0)) == pytest.approx(5.0)
    assert shown(away, Need(25.0, reach=1.0)) == 0.0
    assert shown(both, Need(25.0, reach=1.0)) == pytest.approx(10.0 - 2.0)


def test_the_better_of_most_folds_has_the_weight() -> None:
    even = np.array([1.0, 2.0, 1.0, 2.0])
    np.testing.assert_allclose(best_of_folds([even, even + 0.1]), [1.0, 0.0])
    one, other = best_of_folds([even, even[::-1]])
    assert one + other == 1.0 and 0.3 < one < 0.8


def test_where_nothing_is_named_an_effect_has_to_take_away_enough_to_be() -> None:
    """Of a log of a loss of 100, and of its rows that are added."""
    verdict, model = SimpleNamespace(names=()), SimpleNamespace()
    model.measurements = SimpleNamespace(rows=50)
    last = SimpleNamespace(
        held_out_losses=np.full((4, 1), 25.0), settings=DEFAULT_SETTINGS, model=model
    )
    closed = SimpleNamespace(verdict=verdict, first=last, last=last)
    least = DEFAULT_SETTINGS.min_gain
    need = Need.of(cast(ClosedLoop, closed))
    assert need.margin == pytest.approx(100.0 * least / (1.0 - least))
    [[_, apart], _] = need.distances([rival("one"), rival("other")], 500)
    assert apart**2 == pytest.approx(1100.0 * least / (1.0 - least))


def test_a_drift_and_a_settling_reading_are_told_apart_by_waiting() -> None:
    """Pressing tells no more in its time: neither depends on the load."""
    rivals = [
        rival("drift", SensorDrift(fz=0.05)),
        rival("warm-up", SensorWarmUp(fz=1.0, time_constant=10.0)),
    ]
    plans = [Rest(20.0).plan(IMPACT), Presses("z", 2.0, 1).plan(IMPACT)]
    found = {p.plan.text: p for p in predict(plans, rivals, NEED, twin_forecasts)}
    rest, press = (found[plan.text] for plan in plans)
    assert rest.farthest > press.farthest > 0.0
    assert rest.forecast.channel == "fy" and rest.hazard == ""  # z of S is y of G


def test_what_fits_may_make_up_is_no_difference() -> None:
    """A bias of another size is the same hypothesis."""
    pair = [rival("one", SensorBias(fz=0.5)), rival("other", SensorBias(fz=0.8))]
    loose = [
        dataclasses.replace(one, varied=(other.scenario,))
        for one, other in zip(pair, pair[::-1], strict=True)
    ]
    plans = [Rest(5.0).plan(IMPACT)]
    [tight] = predict(plans, pair, NEED, twin_forecasts)
    [free] = predict(plans, loose, NEED, twin_forecasts)
    assert tight.farthest > 10.0 and free.farthest <= 1.0
    np.testing.assert_allclose(free.bounds, tight.distances)


def test_an_experiment_that_one_rival_makes_dangerous_is_not_performed() -> None:
    turned = GroovePose(rz=-0.06)  # the groove falls: a stroke runs into the lips
    rivals = [rival("nothing"), rival("turned", turned)]
    plans = [
        Reversals(way=0.8, times=1, speed=1.0).plan(IMPACT),
        Rest(1.0).plan(IMPACT),
    ]
    found = {p.plan.text: p for p in predict(plans, rivals, NEED, twin_forecasts)}
    stroke = found[plans[0].text]
    assert "under turned" in stroke.hazard and stroke.value == 0.0
    assert found[plans[1].text].hazard == ""
