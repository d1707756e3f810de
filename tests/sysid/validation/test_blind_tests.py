"""Blind tests: what is put in is found, and a log does not tell."""

from concurrent.futures import Executor, Future

import numpy as np
import pytest

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.effects import CommandGain, SensorBias
from drake_disasm.logs import read_log
from drake_disasm.logs.transitions import observations
from sysid.models.sensor_reading import at_sensor
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import (
    Answer,
    Case,
    nominal,
    observable_effects,
    residual,
    run_case,
    run_cases,
    several_cases,
    single_cases,
)
from sysid.validation.random_effects import random_effect
from sysid.validation.synthetic_logs import transitions_log
from sysid.validation.tables import confusion_figure, errors_table, table


class _Here(Executor):
    """Does the work at once; counts it."""

    done = 0

    def submit(self, function, /, *arguments):
        """Returns a future that is done."""
        self.done += 1
        future = Future()
        future.set_result(Answer(arguments[2], (), "none", (), (), 1.0, 1.0))
        return future


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is():
    assert run_case(Case((), 0.0, 1)).ending == "none"


@pytest.mark.slow
def test_the_whole_library_at_five_times_the_noise():
    cases = single_cases((5.0,), (0,))
    assert [case.key for case in cases if not run_case(case).in_tie] == []


def test_a_model_with_the_effects_explains_a_blind_log(tmp_path):
    scenario = nominal()
    effects = [CommandGain(x=0.02), SensorBias(fy=0.4)]
    transitions_log(tmp_path / "log", scenario, effects, 3, 4, 12)
    scenario.effects = list(effects)
    log = read_log(tmp_path / "log")
    assert log.header.scenario["effects"] == []
    assert "SensorBias" not in (tmp_path / "log" / "log.yaml").read_text("utf-8")
    model = TwinModel([log], scenario, ())
    error = model.predictions(np.zeros(0)) - model.measurements.values
    rms = np.sqrt(np.mean((error / model.measurements.noise) ** 2, axis=0))
    assert rms[:6].max() < 2e-3  # what the noise of the first readings is of an offset
    np.testing.assert_allclose(rms[6:], 1.0, atol=0.35)


def test_effects_are_drawn_by_the_residual_they_leave(tmp_path):
    def size(effect):
        return residual(effect, str(tmp_path))

    effect = random_effect(SensorBias, np.random.default_rng(0), 2.0, size)
    assert size(effect) == pytest.approx(2.0, rel=0.1)


def test_answers_are_kept_and_not_asked_for_again(tmp_path):
    cases = single_cases((1.0, 2.0), (0,))
    executor = _Here()
    with WorkerPool(executor=executor) as pool:
        first = run_cases(cases[:3], pool, FinishedWork(tmp_path))
        assert run_cases(cases[:5], pool, FinishedWork(tmp_path))[:3] == first
    assert executor.done == 5


def test_several_effects_differ_and_can_show():
    names = {effect.__name__ for effect in observable_effects(nominal())}
    for case in several_cases(3, 3.0, range(20)):
        assert len(set(case.effects)) == 3 and set(case.effects) <= names


def test_tables_and_figure_count_what_was_said():
    bias, gain, cases = ("SensorBias",), ("SensorGain",), range(2)
    first, second = (Case(bias, 2.0, seed) for seed in cases)
    right = Answer(first, (), "explained", bias, ((),), 2.0, 1.0)
    tied = Answer(second, (), "explained", gain, (bias,), 2.0, 1.1)
    assert "| SensorBias | 1/2 | 2/2 |" in table([right, tied])
    assert "2.00 → 1.05" in errors_table([right, tied])
    labels = confusion_figure([right, tied]).axes[0].get_xticklabels()
    assert [label.get_text() for label in labels] == ["SensorBias", "SensorGain"]


def test_the_first_reading_has_what_the_sensor_adds(tmp_path):
    """Else an offset would be a step, from the first reading to the second."""
    bias = SensorBias(fx=2.0, ty=-0.3)
    transitions_log(tmp_path / "log", nominal(), [bias], seed=4)
    model = TwinModel([read_log(tmp_path / "log")], nominal(), ())
    noise = model.measurements.sigma[6:]
    first = np.array(
        [
            at_sensor(observations(e)[:1], model.reading.mounting)[0, 6:]
            for e in read_log(tmp_path / "log").episodes
        ]
    )
    wanted = np.array([2.0, 0.0, 0.0, 0.0, -0.3, 0.0])
    assert np.all(np.abs(first.mean(axis=0) - wanted) < 4.0 * noise / len(first) ** 0.5)
