"""Rivals of a step, judged by fits to all rows."""

import math
from types import SimpleNamespace

import numpy as np

from drake_disasm.effects import SensorBias, SensorDrift, SensorStep
from sysid.effect_selection.forward_selection import Gain, Step, Term
from sysid.effect_selection.rival_fits import judged_by_all_rows
from sysid.fitting.candidates import Candidate
from sysid.fitting.settings import DEFAULT_SETTINGS

_TAKEN = {"SensorBias": 30.0, "SensorDrift": 60.0, "SensorStep": 59.0}


class Fits:
    """Fits whose effects each take away so much, and that take none twice."""

    settings = DEFAULT_SETTINGS
    affordable = property(lambda self: self)

    def fit(self, effects, start=None):
        names = [each.name for each in effects]
        assert len(set(names)) == len(names)
        left = 100.0 - sum(_TAKEN[name] for name in names)
        return SimpleNamespace(
            effects=effects,
            held_out_losses=np.full((8, 1), left / 8.0),
            linearisation=SimpleNamespace(u=np.ones(6)),
            null=np.zeros(6),
            half_intervals=np.zeros(6),
            columns_of=lambda effect: range(len(effect.fields)),
        )


def gain(effect, taken: float) -> Gain:
    term = Term((Candidate.of(effect),), np.zeros(1, int), np.zeros(1, int))
    return Gain.of(term, np.full(8, 0.125), np.full(8, 0.125 * (1.0 - taken)))


def test_a_rival_stays_if_all_rows_leave_it_about_as_good() -> None:
    """One that another step has added is none, in whatever shape."""
    bias, drift = gain(SensorBias(), 0.3), gain(SensorDrift(), 0.8)
    again = gain(SensorBias(), 0.8)
    steps = [Step(bias, ()), Step(drift, (gain(SensorStep(), 0.1), again))]
    fits = Fits()
    last = fits.fit([*bias.term.candidates, *drift.term.candidates])
    kept, (first, second) = judged_by_all_rows(fits, [], last, steps, math.inf)
    assert kept is last and first is steps[0]
    assert [rival.term.names for rival in second.rivals] == [("SensorStep",)]


def test_a_rival_that_all_rows_speak_for_is_chosen() -> None:
    bias, drift = gain(SensorBias(), 0.8), gain(SensorDrift(), 0.3)
    fits = Fits()
    last = fits.fit(bias.term.candidates)
    step = Step(bias, (drift, gain(SensorStep(), 0.8)))
    kept, (judged,) = judged_by_all_rows(fits, [], last, [step], math.inf)
    assert judged.chosen.term.names == ("SensorDrift",)
    assert [rival.term.names for rival in judged.rivals] == [("SensorStep",)]
    assert [effect.name for effect in kept.effects] == ["SensorDrift"]
