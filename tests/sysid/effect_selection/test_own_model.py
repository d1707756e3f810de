"""A model of one's own, without a scenario, closed as a library call."""

import json

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    JointCoulombFriction,
    JointEffect,
    JointSamples,
    JointStribeckFriction,
    SensorBias,
    TorqueOffset,
)
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.output import to_mapping
from sysid.models import Channel, LogModel, Measurements
from sysid.parameters import Parameter
from sysid.report import closing_page
from sysid.workers import Workers

_ROWS, _NOISE, _FRICTION = 300, 0.01, 0.3


class Pendulum(LogModel):
    """The torque that holds a pendulum on its way; of two episodes."""

    affine = True
    effect_types = (JointEffect,)

    def __init__(self, q, v, tau):
        self.q, self.v = q, v
        self.parameters = (Parameter("weight", 1.0, 0.0, 5.0, "N m"),)
        channels = [Channel("pivot", "N m", _NOISE, "as given")]
        self.measurements = Measurements.of_array(tau, channels)

    def predict(self, theta, rows):
        load = theta[0] * np.sin(self.q[rows])
        samples = JointSamples(self.q[rows], self.v[rows], 0.0 * load, load)
        effects = self.effects_at(theta)
        return (load + sum(effect.torque(samples) for effect in effects))[:, None]

    def select_rows(self, mask):
        return self.replace(q=self.q[mask], v=self.v[mask])


@pytest.fixture(scope="module")
def pendulum():
    random = np.random.default_rng(0)
    t = np.arange(_ROWS) * 0.05
    q, v = np.sin(t) + 0.3 * np.sin(2.7 * t), np.cos(t) + 0.81 * np.cos(2.7 * t)
    tau = 2.0 * np.sin(q) + _FRICTION * np.sign(v)
    return Pendulum(q, v, (tau + _NOISE * random.standard_normal(_ROWS))[:, None])


@pytest.fixture(scope="module")
def closed(pendulum):
    return close_loop(pendulum)


def test_all_but_the_model_has_a_default(closed):
    assert closed.verdict.ending == "explained"
    assert closed.verdict.names[0] == "JointCoulombFriction.pivot"
    found = {value.name: value for value in closed.verdict.values}
    friction = found["JointCoulombFriction.pivot.size"]
    assert friction.value == pytest.approx(_FRICTION, abs=0.02)
    assert friction.excludes_null and friction.unit == "N m"
    assert closed.errors.in_noise(closed.errors.after) < 1.3


def test_there_is_no_scenario_and_a_report_all_the_same(closed):
    assert closed.scenario is None
    assert "JointCoulombFriction" in closing_page(closed, {})
    mapping = json.loads(json.dumps(to_mapping(closed)))
    assert mapping["effects"] == list(closed.verdict.names)
    assert mapping["sentence"] == closed.sentence


def test_prints_nothing_unless_progress_is_given(pendulum, capsys):
    updates = []
    close_loop(pendulum, library=[JointCoulombFriction], progress=updates.append)
    assert capsys.readouterr() == ("", "") and updates


def test_an_unexplained_residual_beyond_the_stated_noise_is_called_so(pendulum):
    found = close_loop(pendulum, library=[TorqueOffset])
    assert found.verdict.ending == "unexplained"
    assert found.verdict.excess == pytest.approx(_FRICTION / _NOISE, rel=0.2)
    assert "no effect of the library explains" in found.sentence


def test_a_model_on_which_no_effect_can_act_is_refused(pendulum):
    with pytest.raises(DisasmError, match=r"Pendulum.* effect_types"):
        close_loop(pendulum, library=[SensorBias])


class Simulated(Pendulum):
    """The same, of which nobody says that effects are linear."""

    affine = False


@pytest.mark.slow
def test_trials_side_by_side_are_those_one_by_one(pendulum):
    model = Simulated(pendulum.q, pendulum.v, pendulum.measurements.values)
    library = [JointCoulombFriction, JointStribeckFriction, TorqueOffset]
    found = []
    for count in (1, 2):
        told = []
        with Workers(count) as workers:
            closed = close_loop(
                model, library=library, workers=workers, progress=told.append
            )
        found.append((closed.text, [update.message for update in told]))
    assert found[0] == found[1]
    assert "missing: JointCoulombFriction.pivot" in found[0][0]
