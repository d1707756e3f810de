"""Once all effects are there, each is compared with what could be in its place."""

from types import SimpleNamespace

import numpy as np
import pytest

from drake_disasm.effects import JointElasticity, JointViscousFriction, TorqueGain
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.search import LinearSearch, SelectionRound
from sysid.effect_selection.settings import DEFAULT_SETTINGS

_GEAR, _GAIN, _RUBS = (
    Candidate.of(kind(joint="j1"))
    for kind in (JointElasticity, TorqueGain, JointViscousFriction)
)
_SCATTER = np.random.default_rng(0).normal(size=40)


def _evidence(candidate, gain, scatter):
    gains = gain * (1.0 + scatter * _SCATTER)
    return Evidence((candidate,), gain, 0.01, 1.0, 1, gains, DEFAULT_SETTINGS)


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

    def __init__(self, evidence, loss):
        fitter = SimpleNamespace(settings=DEFAULT_SETTINGS)
        super().__init__(fitter, [_GEAR, _GAIN])
        self._found, self._loss = evidence, loss
        self._record(evidence[0], (), self._survey(None), _fit((), 1.0))

    def _fit_without(self, fit, effect):
        assert effect is _GEAR
        return _fit((_RUBS,), 20.0)

    def _survey(self, fit):
        return SimpleNamespace(effects=self._found, record=lambda: None)

    def _fit_chosen(self, fit, survey, chosen):
        return _fit((*fit.effects, *chosen.candidates), self._loss)


def test_what_could_be_in_an_effects_place_is_a_tie():
    gear, gain = _evidence(_GEAR, 0.5, 2.0), _evidence(_GAIN, 0.48, -2.0)
    search = _Search([gear, gain], 10.0)
    assert search._exchanged(_fit((_RUBS, _GEAR), 10.0)) is None
    (found,) = search._rounds
    assert found.chosen is gear and found.ties == (gain,)


@pytest.mark.parametrize(("loss", "is_better"), [(5.0, True), (9.99, False)])
def test_what_explains_clearly_more_takes_an_effects_place(loss, is_better):
    """The blocks distinguish them; the fit has to confirm it."""
    gear, gain = _evidence(_GEAR, 0.5, 0.0), _evidence(_GAIN, 0.75, 0.0)
    search = _Search([gear, gain], loss)
    found = search._exchanged(_fit((_RUBS, _GEAR), 10.0))
    (recorded,) = search._rounds
    assert isinstance(recorded, SelectionRound)
    assert recorded.chosen is (gain if is_better else gear)
    assert (found is not None) == is_better
    if is_better:
        assert found.effects == (_RUBS, _GAIN)
