"""A model that has only what a user has to write: everything else has a default."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import (
    Effect,
    Imprecision,
    JointCoulombFriction,
    JointEffect,
    JointSamples,
    JointViscousFriction,
    SensorBias,
    amplitude,
)
from sysid.identification import SearchSettings, Settings, identify
from sysid.models import Channel, LogModel, Measurements
from sysid.models.effects import effect_parameter
from sysid.objective import Objective
from sysid.parameters import Parameter
from sysid.workers import Workers
from tests.refusals import refused

INERTIA, WEIGHT = 0.05, 1.2
HIDDEN = JointCoulombFriction("pivot", 0.15)


class Pendulum(LogModel):
    """tau = J vd + w sin q + the effects at the pivot."""

    effect_types = (JointEffect,)

    def __init__(self, motion, torque):
        self.motion = motion
        self.parameters = (
            Parameter("J", 0.02, 0.0, 1.0, "kg m^2"),
            Parameter("w", 1.0, 0.0, 5.0, "N m"),
        )
        self.measurements = Measurements.of_array(torque, [Channel("pivot", "N m")])

    def predict(self, theta, rows):
        q, v, vd = self.motion[rows].T
        rigid = theta[0] * vd + theta[1] * np.sin(q)
        samples = JointSamples(q, v, vd, rigid)
        return rigid + sum(e.torque(samples) for e in self.effects_at(theta))

    def select_rows(self, mask):
        return Pendulum(self.motion[mask], np.zeros(mask.sum()))  # forgets the rest


@pytest.fixture
def model() -> Pendulum:
    """A pendulum that rubs, and a model that knows nothing of it."""
    t = 0.05 * np.arange(400)
    q, v, vd = np.sin(2 * t), 2 * np.cos(2 * t), -4 * np.sin(2 * t)
    rigid = INERTIA * vd + WEIGHT * np.sin(q)
    torque = rigid + HIDDEN.torque(JointSamples(q, v, vd, rigid))
    noise = 0.02 * np.random.default_rng(0).normal(size=400)
    return Pendulum(np.column_stack([q, v, vd]), torque + noise)


def with_friction(model: Pendulum, *fields: str) -> Pendulum:
    effects = [JointCoulombFriction("pivot")]
    parameters = [effect_parameter(effects, 0, field) for field in fields]
    return model.with_effects(effects, parameters)


def test_the_example_of_a_single_channel_predicts_a_column(model):
    assert model.predictions(np.array([INERTIA, WEIGHT])).shape == (400, 1)


def test_an_effect_acts_through_its_parameters(model):
    theta = np.array([INERTIA, WEIGHT, 0.15])
    rubbing = with_friction(model, "size")
    difference = rubbing.predictions(theta) - model.predictions(theta[:2])
    v = model.motion[:, 1]
    np.testing.assert_allclose(difference[:, 0], 0.15 * np.tanh(v / 0.02))
    assert rubbing.effects == (JointCoulombFriction("pivot"),)
    assert rubbing.effects_at(theta) == (HIDDEN,)
    assert [p.name for p in rubbing.parameters] == ["J", "w", "effects.0.size"]
    assert rubbing.parameters[2].unit == "N m" and not rubbing.parameters[2].is_shape


@pytest.mark.parametrize("frozen", ["J", "effects.0.creep"])
def test_a_frozen_parameter_keeps_its_place(frozen, model):
    whole = with_friction(model, "size", "creep")
    values = dict(
        zip([p.name for p in whole.parameters], [0.04, 1.1, 0.2, 0.05], strict=True)
    )
    part = whole.freeze({frozen: values.pop(frozen)})
    assert [p.name for p in part.parameters] == list(values)
    theta = np.array(list(values.values()))
    expected = whole.predictions(np.array([0.04, 1.1, 0.2, 0.05]))
    assert part.predictions(theta).tobytes() == expected.tobytes()
    half = part.of_rows(np.arange(400) % 2 == 0).freeze({"J": 0.04, "w": 1.1})
    left = theta[-len(half.parameters) :]
    assert half.predictions(left).tobytes() == expected[::2].tobytes()


def test_rows_are_selected_with_all_that_the_model_has_become(model):
    noise = np.array([0.5])
    changed = with_friction(model, "size").with_measurements(
        model.measurements.with_noise(noise, "given")
    )
    part = changed.thin(4)
    assert part.measurements.noise == noise and part.measurements.rows == 100
    assert part.effects == changed.effects and part.parameters == changed.parameters
    assert part.measurements.values[1] == model.measurements.values[4]


class Tension(Effect):
    """An effect of the user's own, of no class of the library."""


def test_what_could_act_is_what_predict_applies(model):
    kinds = (JointViscousFriction, SensorBias, JointCoulombFriction, Imprecision)
    found = model.applicable_effects(kinds)
    assert [type(e) for e in found] == [JointViscousFriction] + [
        JointCoulombFriction
    ] * 3
    assert {e.joint for e in found} == {"pivot"} and all(e.is_null for e in found)
    assert len({e.creep for e in found[1:]}) == 3

    @dataclasses.dataclass
    class Spring(Tension):
        stiffness: float = amplitude("N m/rad", 0.0, 10.0, "stiffness")

    model.__class__ = type("Elastic", (Pendulum,), {"effect_types": (Tension,)})
    assert model.applicable_effects([*kinds, Spring]) == [Spring()]


def test_identifies_the_effect_with_defaults_alone(model):
    search = SearchSettings(evaluations=40, local_evaluations=10)
    found = identify(
        with_friction(model, "size"), settings=Settings(("nlopt",), search)
    )
    assert found.values["effects.0.size"] == pytest.approx(0.15, rel=0.03)
    low, high = found.interval_bootstrap[2]
    assert low < 0.15 < high
    assert found.channels[0].noise == pytest.approx(0.02, rel=0.1)
    assert found.scenario is None and found.held_out is None


def test_predictions_of_another_shape_are_refused(model):
    class Wide(Pendulum):
        def predict(self, theta, rows):
            return np.zeros((rows.stop - rows.start, 2))

    model.__class__ = Wide
    with refused("Wide.predict", "(400, 2)"):
        Objective(model, Workers())(np.array([[INERTIA, WEIGHT]]))


def test_parameters_and_measurements_that_do_not_fit_are_refused(model):
    twice = model.replace(parameters=(*model.parameters, model.parameters[0]))
    with refused("two parameters", "'J'"):
        Objective(twice)
    with refused("(rows, 2)"):
        Measurements.of_array(np.zeros(3), [Channel("a", "N"), Channel("b", "N")])
    with refused("3 rows"):
        Measurements(np.zeros((3, 1)), (Channel("a", "N"),), np.zeros(2, int), ("x",))
