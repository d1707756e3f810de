"""Closing the loop on simulated readings that carry an effect nobody declared."""

import numpy as np
import pytest

from drake_disasm.effects import EFFECTS, SensorDrift, SensorGain, SensorMounting
from sysid.tracing.study import family_p
from tests.sysid.tracing.blind import closed, static_log, verdict_of


@pytest.mark.parametrize("kind", [SensorDrift, SensorMounting, SensorGain])
def test_names_the_effect_or_a_tie_with_it(kind, tmp_path):
    found = closed(static_log(tmp_path, [kind], 2.0, seed=0).folder)
    verdict = found.verdict
    assert verdict.ending == "explained"
    assert kind.__name__ in (verdict.names[0], *(t.name for t in verdict.ties[0]))
    errors = found.errors
    assert errors.in_noise(errors.after) < 0.9 * errors.in_noise(errors.before)


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_says_none_where_there_is_none(correlation, tmp_path):
    verdict = verdict_of(static_log(tmp_path, [], 0.0, 3, correlation).folder)
    assert (verdict.ending, verdict.names) == ("none", ())
    assert "missing: none" in verdict.text


def test_an_effect_outside_the_library_gets_no_wrong_name(tmp_path):
    log = static_log(tmp_path, [SensorDrift], 5.0, seed=1).folder
    names = ("SensorGain", "SensorMounting")
    library = [e for e in EFFECTS if e.__name__ in names]
    verdict = verdict_of(log, library)
    assert verdict.ending == "unexplained" and "time" in verdict.dependence


def test_the_family_wise_p_is_uniform_under_the_null():
    random = np.random.default_rng(0)
    alarms = sum(
        family_p(random.standard_normal((20, 12)), seed).min() < 0.05
        for seed in range(100)
    )
    assert alarms <= 12
