"""Closing the loop on simulated readings that carry an effect nobody declared."""

import dataclasses

import numpy as np
import pytest
from damaged_logs import changed, damaged, with_episode

from drake_disasm.effects import (
    GroovePose,
    SensorBias,
    SensorDrift,
    SensorGain,
    SensorGainDrift,
    SensorMounting,
    SensorStep,
    registered_effects,
)
from drake_disasm.logs import read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.output import to_mapping
from sysid.effect_selection.verdict import judge
from sysid.fitting.settings import SelectionSettings
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.twin import TwinModel
from sysid.report import closing_page
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from tests.refusals import refused
from tests.sysid.effect_selection.blind import closed, static_log

_BIASED = ("SensorDrift", "SensorGain", "SensorMounting")
_LIBRARY = [e for e in registered_effects() if e.__name__ in _BIASED]


@pytest.mark.parametrize("kind", [SensorMounting, SensorGainDrift])
def test_names_the_effect_or_a_rival_of_it(kind, tmp_path):
    library = [SensorMounting, SensorGainDrift, *_LIBRARY]
    found = closed(static_log(tmp_path, [kind], 2.0, seed=0), library)
    verdict = found.verdict
    assert kind.__name__ in (verdict.names[0], *(t.name for t in verdict.ties[0]))
    errors = found.errors
    assert errors.in_noise(errors.after) < 0.9 * errors.in_noise(errors.before)


def test_a_step_is_placed_and_only_suggested_by_one_recording(tmp_path):
    onset = 42.0
    log = static_log(tmp_path, [SensorStep], 3.0, seed=0, shape={"onset": onset})
    verdict = closed(log, [SensorStep, SensorMounting]).verdict
    assert (verdict.ending, verdict.names) == ("unexplained", ("SensorStep",))
    assert verdict.suggested == ("SensorStep",)
    found = {v.name: v.value for v in verdict.values}
    middle = found["SensorStep.onset"] + found["SensorStep.rise"] / 2.0
    assert middle == pytest.approx(onset, abs=1.5)


def test_shapes_that_no_row_depends_on_are_not_tried_and_not_estimated(tmp_path):
    """A drift that ends after the log has looks like one that never does."""
    short = np.arange(100) < 40
    log = static_log(tmp_path, [SensorDrift], 5.0, seed=0)
    library = [SensorDrift, SensorGain]
    model = model_of([log], ModelChoice()).of_rows(short)
    found = close_loop(model, library=library)
    shapes = {gain.text for gain in found.search.begin}
    assert found.verdict.names == ("SensorDrift",)
    assert "SensorDrift.duration" not in found.text
    assert "SensorDrift[duration=30]" in shapes
    assert "SensorDrift[duration=50]" not in shapes


def test_none_is_for_white_residuals_of_rows_that_are_what_they_should_be(tmp_path):
    found = closed(static_log(tmp_path, [], 0.0, 3), _LIBRARY)
    assert (found.verdict.ending, found.verdict.names) == ("none", ())
    moving = judge(found.search, found.errors, misfits=["rows that move"])
    assert moving.ending == "unexplained"


def test_correlated_residuals_are_never_noise(tmp_path):
    verdict = closed(static_log(tmp_path, [], 0.0, 3, 0.5), _LIBRARY).verdict
    assert verdict.ending == "unexplained" and verdict.correlated
    assert not verdict.names


def test_thresholds_are_passed_down(tmp_path):
    log = static_log(tmp_path, [SensorDrift], 5.0, seed=2)
    model, settings = model_of([log], ModelChoice()), SelectionSettings(min_gain=0.999)
    found = close_loop(model, settings=settings, library=[SensorDrift])
    assert not found.verdict.names


def test_an_effect_outside_the_library_gets_no_wrong_name(tmp_path):
    log = static_log(tmp_path, [SensorDrift], 5.0, seed=1)
    verdict = closed(log, [SensorGain, SensorMounting]).verdict
    assert verdict.ending == "unexplained" and not verdict.names


def test_two_effects_are_both_found_and_the_confirmed_one_is_said_first(tmp_path):
    log = static_log(tmp_path, [SensorDrift, SensorMounting], 5.0, seed=2)
    found = closed(log, _LIBRARY)
    verdict = found.verdict
    assert verdict.confirmed == ("SensorMounting",)
    assert verdict.suggested == ("SensorDrift",)
    assert verdict.ending == "partly"
    assert found.last.objective < 0.5 * found.first.objective


def test_episodes_that_contradict_each_other_are_named(tmp_path):
    logs = [
        static_log(tmp_path / name, kinds, 5.0, seed)
        for name, kinds, seed in (("a", [SensorDrift], 0), ("b", [], 1))
    ]
    logs = [
        dataclasses.replace(log, folder=tmp_path / name)
        for log, name in zip(logs, ("drifting", "steady"), strict=True)
    ]
    model = model_of(logs, ModelChoice())
    found = close_loop(model, library=_LIBRARY)
    [against] = found.verdict.contradictions
    assert [name.split("/")[0] for name in against.episodes] == ["drifting", "steady"]
    assert against.effect.startswith("SensorDrift")
    assert "contradict" in closing_page(found, {})
    assert to_mapping(found)["contradictions"][0]["effect"] == against.effect


def test_an_offset_in_one_episode_of_nine_is_named_with_it(tmp_path):
    """Its rows weigh little in a common fit, so that no other episode gains."""
    transitions_log(tmp_path / "log", nominal(), [], 8, 8, steps=12)
    transitions_log(tmp_path / "with", nominal(), [SensorBias(fy=1.0)], 8, 1, steps=12)
    log, with_offset = (read_log(tmp_path / name) for name in ("log", "with"))
    model = TwinModel([with_episode(log, with_offset, 4)], nominal(), ())
    found = close_loop(model, library=[SensorBias], train=range(9), test=[])
    [against] = found.verdict.contradictions
    assert against.effect == "SensorBias"
    assert against.episodes == (model.measurements.names[4],)


@pytest.mark.slow
def test_rows_that_are_off_in_every_episode_are_no_contradiction(tmp_path):
    transitions_log(tmp_path / "log", nominal(), [], 8, 9)
    add = changed("wrench.fy", [3, 9, 15], lambda values: values + 5.0)
    log = damaged(read_log(tmp_path / "log"), add)
    model = TwinModel([log], nominal(), ())
    found = close_loop(model, library=[GroovePose], train=range(9), test=[])
    assert found.verdict.contradictions == ()
    assert found.verdict.ending == "unexplained"


def test_a_log_that_is_too_short_is_refused_with_what_it_needs(tmp_path):
    log = static_log(tmp_path, [SensorDrift], 5.0, seed=0)
    model = model_of([log], ModelChoice()).of_rows(np.arange(100) < 4)
    with refused("too short", "2 rows more"):
        close_loop(model)
