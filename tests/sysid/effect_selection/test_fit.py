"""What a fit says of itself, and that it ends at the bottom of its valley."""

import numpy as np
import pytest

from drake_disasm.effects import CommandGain, GroovePose
from drake_disasm.logs import read_log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.effect_selection.candidates import candidates
from sysid.effect_selection.close_loop import HUBER
from sysid.effect_selection.search import Tracer
from sysid.models.twin import TwinModel
from sysid.objective import Objective
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers

_TURN = np.deg2rad(2.0)  # of removal_turned


@pytest.fixture(scope="module")
def gain(tmp_path_factory):
    """A search in a log of an arm that goes 3 % too far along x."""
    folder = tmp_path_factory.mktemp("gain") / "log"
    transitions_log(folder, nominal(), [CommandGain(x=0.03)], 0, episodes=6, steps=12)
    return _search(TwinModel([read_log(folder)], nominal(), ()), CommandGain)


def _search(model, kind):
    """Returns a tracer that knows one effect."""
    library = candidates(model, [kind])
    return Tracer(model, library, Workers(), HUBER, lambda _: None)


def test_an_effect_is_worth_what_the_loss_rises_by_without_it(gain):
    before, fit = gain.fit(()), gain.fit(tuple(gain.library))
    assert fit.worth["CommandGain"] == pytest.approx(
        1 - fit.loss / before.loss, abs=0.03
    )
    x = fit.columns_of(gain.library[0].only(["x"]))
    assert fit.gains_of([x]) == pytest.approx([fit.worth["CommandGain"]], abs=0.03)
    assert fit.shows[x].all()


def test_sizes_that_gain_nothing_go(gain):
    fit = gain.fit(tuple(gain.library))
    simple = gain.simplified(fit)
    assert len(fit.effects[0].fields) == 6
    assert simple.effects[0].fields == ("x",)
    assert simple.theta == pytest.approx([0.03], rel=0.02)
    assert simple.loss < 1.01 * fit.loss
    assert gain.simplified(simple) is simple


def test_an_added_effect_ends_where_the_models_own_derivatives_lead(tmp_path):
    turned = load_scenario("removal_turned", ["task.steps=14"])
    policy = Exploring(make_policy("admittance"), 1.5e-4, 0)
    simulation = TaskSimulation(turned, "twin", policy)
    log = record_transitions(tmp_path / "log", simulation, 28)
    model = TwinModel([log], load_scenario("removal"), ())
    tracer = _search(model, GroovePose)
    effect = tracer.library[0].only(["ry", "x"])
    assert model.costly
    near = tracer.fit((effect,), values={"GroovePose.ry": 0.9 * _TURN})
    fit = tracer._settled(near)
    assert fit.value < near.value
    at_truth = Objective(model.with_effects(turned.effects), Workers(), HUBER)(
        np.zeros(0)
    )[0]
    assert fit.value < at_truth
    assert fit.values["GroovePose.ry"] == pytest.approx(_TURN, rel=0.03)
