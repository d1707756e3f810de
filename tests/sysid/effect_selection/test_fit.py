"""What a fit says of itself, and that it ends at the bottom of its valley."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import CommandGain, Compliance, GroovePose
from drake_disasm.logs import read_log
from sysid.effect_selection.candidates import candidates
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.simplification import simplified
from sysid.effect_selection.verdict import parameter_values
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers


def _fitter(folder, effect, episodes=6):
    """Returns a fitter of a log that has an effect, and the candidate of its kind."""
    transitions_log(folder / "log", nominal(), [effect], 0, episodes, steps=12)
    model = TwinModel([read_log(folder / "log")], nominal(), ())
    (candidate,) = candidates(model, [type(effect)])
    delta = model.default_huber_delta
    return Fitter(model, Workers(), delta, SelectionSettings()), candidate


@pytest.fixture(scope="module")
def gain(tmp_path_factory):
    """Of an arm that goes 3 % too far along x."""
    return _fitter(tmp_path_factory.mktemp("gain"), CommandGain(x=0.03))


def test_an_effect_is_worth_what_the_loss_rises_by_without_it(gain):
    fitter, effect = gain
    before, fit = fitter.fit(()), fitter.fit((effect,))
    assert fit.effect_gains["CommandGain"] == pytest.approx(
        1 - fit.loss / before.loss, abs=0.03
    )
    x = fit.columns_of(effect.only(["x"]))
    whole = fit.effect_gains["CommandGain"]
    assert fit.gains_of([x]) == pytest.approx([whole], abs=0.03)
    assert fit.significant[x].all()


def test_the_error_of_coarse_time_steps_leads_to_the_fit_in_fine_ones(tmp_path):
    """Where a fit in fine steps ends, the estimate is off no more."""
    fitter, effect = _fitter(tmp_path, GroovePose(ry=0.02), episodes=4)
    turn = effect.only(["ry"])
    coarse = fitter.fit((turn,))
    fine = fitter.with_base(fitter.base.refined()).fit((turn,), coarse)
    moved = fine.linearisation.u - coarse.linearisation.u
    assert np.abs(moved).max() > 1e-7
    np.testing.assert_allclose(coarse.error_of_steps, moved, rtol=0.5, atol=1e-7)
    assert not fine.error_of_steps.any()
    (value,) = parameter_values(coarse, 0)[:1]
    most_of_the_way = coarse.theta[0] + 0.8 * (fine.theta[0] - coarse.theta[0])
    assert value.interval[0] <= most_of_the_way <= value.interval[1]


def _with(fit, **changes):
    linearisation = dataclasses.replace(fit.linearisation, **changes)
    return dataclasses.replace(fit, linearisation=linearisation)


def test_an_amplitude_that_its_bound_holds_back_is_noticed(gain):
    """At a bound past which the loss would fall, or at one that is null."""
    fitter, effect = gain
    fit = fitter.fit((effect.only(["x"]),))
    assert not fit.at_bound(["CommandGain"])
    content = _with(fit, u=np.ones_like(fit.linearisation.u))
    assert not content.at_bound(["CommandGain"])
    (column,) = content.columns_of(fit.effects[0])
    derivative = content.linearisation.jacobian[..., column]
    held_back = _with(content, residual=-0.5 * derivative)
    assert held_back.at_bound(["CommandGain"])
    assert not held_back.at_bound(["SensorBias"])
    assert held_back.within_bounds(fit.effects) == []
    pushed_inwards = _with(content, residual=0.5 * derivative)
    assert pushed_inwards.within_bounds(fit.effects) == list(fit.effects)


def test_an_amplitude_at_a_bound_that_is_null_is_none(tmp_path):
    fitter, effect = _fitter(tmp_path, Compliance(y=3.6e-5))
    fit = fitter.fit((effect.only(["y"]),))
    assert fit.within_bounds(fit.effects) == list(fit.effects)
    none = _with(fit, u=fit.null, residual=np.zeros_like(fit.linearisation.residual))
    assert none.at_bound(["Compliance"]) and none.within_bounds(fit.effects) == []


def test_amplitudes_that_gain_nothing_are_left_out(gain):
    fitter, effect = gain
    fit = fitter.fit((effect,))
    simple = simplified(fitter, fit)
    assert len(fit.effects[0].fields) == 6
    assert simple.effects[0].fields == ("x",)
    assert simple.theta == pytest.approx([0.03], rel=0.02)
    assert simple.loss < 1.01 * fit.loss
    assert simplified(fitter, simple) is simple


@pytest.mark.parametrize(
    ("off", "fy", "harmed"),
    [
        (60.0, (0.1, 0.95), []),  # within its noise, for a thousandth of the gain
        (3.0, (0.1, 0.95), ["fy"]),
        (60.0, (4.0, 5.3), []),  # beyond its noise, by little
        (30.0, (4.0, 5.3), ["fy"]),
        (60.0, (4.0, 6.0), ["fy"]),  # its double
    ],
)
def test_a_channel_may_pay_little_of_what_another_gains(gain, off, fy, harmed):
    fitter, effect = gain
    fit = fitter.fit((effect,))
    names = [c.name for c in fit.model.measurements.channels]
    before, after = (fit.linearisation.residual.copy() for _ in range(2))
    before[:, names.index("fz")] = off
    before[:, names.index("fy")], after[:, names.index("fy")] = fy
    first, last = (_with(fit, residual=r, huber_delta=np.inf) for r in (before, after))
    assert last.harmed_channels(first) == harmed
