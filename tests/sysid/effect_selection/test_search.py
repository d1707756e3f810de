"""Once all effects are there, each is compared with what could be in its place."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from drake_disasm.effects import (
    JointCoupling,
    JointDelay,
    JointElasticity,
    JointViscousFriction,
    TorqueGain,
    TorqueRipple,
)
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.search import LinearSearch, SelectionRound
from sysid.effect_selection.settings import DEFAULT_SETTINGS

_GEAR, _GAIN, _RUBS = (
    Candidate.of(kind(joint="j1"))
    for kind in (JointElasticity, TorqueGain, JointViscousFriction)
)
_COUPLING, _NEXT_RUBS = (
    Candidate.of(JointCoupling(joint="j1")),
    Candidate.of(JointViscousFriction(joint="j2")),
)
_DELAY = Candidate.of(JointDelay(joint="j1"))
_BOTH_RIPPLES = tuple(Candidate.of(TorqueRipple(joint=j)) for j in ("j1", "j2"))
_SCATTER = np.random.default_rng(0).normal(size=40)


def _evidence(candidates, gain, scatter):
    gains = gain * (1.0 + scatter * _SCATTER)
    count = sum(len(c.fields) + len(c.shape) for c in candidates)
    return Evidence(candidates, gain, 0.01, 1.0, count, gains, DEFAULT_SETTINGS)


def _fit(effects, loss):
    return SimpleNamespace(
        effects=effects,
        loss=loss,
        objective=0.0,
        at_bound=lambda names: False,
        harmed_channels=lambda before: [],
        is_misshapen=lambda names: False,
        all_significant=lambda names: True,
    )


class _Search(LinearSearch):
    """Has a gear in a fit, and a survey without it."""

    def __init__(self, evidence, loss, pairs=()):
        fitter = SimpleNamespace(settings=DEFAULT_SETTINGS)
        self._pairs = pairs
        super().__init__(fitter, [_GEAR, _GAIN])
        self._found, self._loss = evidence, loss
        self._record(evidence[0], (), self._survey(None), _fit((), 1.0))

    def _fit_without(self, fit, effect):
        assert effect.name == self._found[0].effects[0]
        return _fit((_RUBS,), 20.0)

    def _survey(self, fit, library=None):
        linear = SimpleNamespace(accepted_pairs=lambda singles: self._pairs)
        return SimpleNamespace(
            effects=self._found, linearised=linear, record=lambda: None
        )

    def _is_confirmed(self, before, after, trial):
        return self._is_better(before, after, trial)

    def _fit_chosen(self, fit, survey, chosen):
        return _fit((*fit.effects, *chosen.candidates), self._loss)


def test_what_could_be_in_an_effects_place_is_a_tie():
    gear, gain = _evidence((_GEAR,), 0.5, 2.0), _evidence((_GAIN,), 0.4, -2.0)
    search = _Search([gear, gain], 10.0)
    assert search._exchanged(_fit((_RUBS, _GEAR), 10.0)) is None
    (found,) = search._rounds
    assert found.chosen is gear and found.ties == (gain,)


@pytest.mark.parametrize(("loss", "is_better"), [(5.0, True), (12.0, False)])
def test_what_explains_clearly_more_takes_an_effects_place(loss, is_better):
    """The blocks distinguish them; the fit has to confirm it."""
    gear, gain = _evidence((_GEAR,), 0.5, 0.0), _evidence((_GAIN,), 0.75, 0.0)
    search = _Search([gear, gain], loss)
    found = search._exchanged(_fit((_RUBS, _GEAR), 10.0))
    (recorded,) = search._rounds
    assert isinstance(recorded, SelectionRound)
    assert recorded.chosen is (gain if is_better else gear)
    assert (found is not None) == is_better
    if is_better:
        assert found.effects == (_RUBS, _GAIN)


def test_what_stood_for_two_simpler_effects_makes_room_for_both():
    """A coupling is two amplitudes, and rarer than friction of two joints."""
    coupling = _evidence((_COUPLING,), 0.5, 0.0)
    both = _evidence((_RUBS, _NEXT_RUBS), 0.499, 0.0)
    with_itself = _evidence((_COUPLING, _RUBS), 0.9, 0.0)
    search = _Search([coupling], 10.0, pairs=[with_itself, both])
    found = search._exchanged(_fit((_GAIN, _COUPLING), 10.0))
    assert found.effects[-2:] == (_RUBS, _NEXT_RUBS)
    assert search._rounds[0].chosen is both
    # It does not come back in this way.
    back = _Search([both, coupling], 10.0)
    back._replaced = search._replaced
    assert back._simplest(both, back._survey(None)) is both


class _Ripples(_Search):
    """Has ripples of two joints, chosen as a group, and a survey without them."""

    def __init__(self, evidence, loss, ties):
        super().__init__([_evidence(_BOTH_RIPPLES, 0.5, 0.0)], loss)
        self._found = evidence
        self._rounds = [dataclasses.replace(self._rounds[0], ties=tuple(ties))]
        self.fitter.fit = lambda kept, fit: _fit(kept, 20.0)


@pytest.mark.parametrize(("loss", "is_as_good"), [(10.9, True), (11.1, False)])
def test_one_effect_takes_the_place_of_a_group_that_stood_for_it(loss, is_as_good):
    """If it explains nearly as much: a tenth of what the group takes off is given."""
    delay = _evidence((_DELAY,), 0.49, 0.0)
    search = _Ripples([delay], loss, [delay])
    found = search._exchanged(_fit((_RUBS, *_BOTH_RIPPLES), 10.0))
    assert (found is not None) == is_as_good
    (recorded,) = search._rounds
    if is_as_good:
        assert found.effects == (_RUBS, _DELAY) and recorded.chosen is delay
        assert search._exchanged(_fit(found.effects, loss)) is None


def test_what_is_no_rival_of_a_group_does_not_take_its_place():
    delay, gain = _evidence((_DELAY,), 0.49, 0.0), _evidence((_GAIN,), 0.3, 0.0)
    search = _Ripples([delay, gain], 10.0, [gain])
    search._fit_chosen = lambda fit, survey, chosen: _fit(chosen.candidates, 15.0)
    assert search._exchanged(_fit((_RUBS, *_BOTH_RIPPLES), 10.0)) is None
    assert search._rounds[0].chosen.candidates == _BOTH_RIPPLES
