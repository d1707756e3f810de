"""Effects: declared in full, nothing at their null values, their equation else."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from drake_disasm import effects as ef
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import STIFF
from tests.drake_disasm.effects.learned_files import step_in_fy
from tests.refusals import refusal

G_W = np.array([0.0, 0.0, -9.81])
ENVIRONMENT = ef.Environment(
    RigidTransform([0.001, 0, 0]), 0.2, 1e9, 1e8, 20.0, 4e-4, 1e3, 1.0
)
STEPS = 10  # in contact from the third
MOVING = ef.BoltMotion(np.array([0.03, 0.001, -0.001]), np.array([0.02, 0.0, 0.005]))


SHIPPED = [e for e in ef.registered_effects() if e.__module__.startswith("drake_")]
IN_CELL = [
    effect
    for effect in SHIPPED
    if not issubclass(effect, ef.ArmEffect)
    and effect is not ef.DetentTorque  # of a part that has one: see test_parts.py
]
SAMPLES = ef.JointSamples(
    q=np.zeros(3),
    v=np.array([-0.5, 0.0, 2.0]),
    vd=np.array([1.0, -1.0, 3.0]),
    load=np.array([10.0, -20.0, 30.0]),
)


def _sensing(rpy: tuple[float, float, float], time: float = 1.0) -> ef.Sensing:
    R_WS = RollPitchYaw(np.array(rpy)).ToRotationMatrix().matrix()
    return ef.Sensing(np.array(time), R_WS, G_W)


def test_every_effect_vanishes_at_null_as_a_function() -> None:
    wrench = np.array([1.1, -2.2, 3.3, 0.1, -0.2, 0.3])
    for null in (effect() for effect in SHIPPED):
        if isinstance(null, ef.EnvironmentEffect):
            changed = null.apply(ENVIRONMENT, MOVING)
            assert changed.X_GnG.IsExactlyEqualTo(ENVIRONMENT.X_GnG), null
            same = dataclasses.replace(changed, X_GnG=ENVIRONMENT.X_GnG)
            assert same == ENVIRONMENT, null
        if isinstance(null, ef.SensorEffect):
            read = null.apply(wrench, _sensing((0.3, -0.8, 2.0)))
            assert np.array_equal(read, wrench), null
        if isinstance(null, ef.JointEffect):
            assert not null.torque(SAMPLES).any(), null
        if isinstance(null, ef.FlangePayload):
            assert not null.inertial.any()


def _trajectory(
    effects: list[ef.Effect], steps: int, model: str = "hydroelastic"
) -> np.ndarray:
    """An episode in contact, with some turning: the groove is turned and rubs."""
    steps_of_3_mm = "task.max_translation=0.003"  # or exploration's would be clipped
    scenario = load_scenario("removal_turned", [STIFF, steps_of_3_mm])
    scenario.effects = [*scenario.effects, *effects]
    scenario.contact.model = model
    policy = Exploring(make_policy("straight"), 2e-4, 0)
    simulation = TaskSimulation(scenario, "twin", policy)
    simulation.reset(7)
    return np.array([simulation.step().observation for _ in range(steps)])


@pytest.fixture(scope="module")
def without() -> np.ndarray:
    """The trajectory without the effect."""
    return _trajectory([], STEPS)


def test_all_effects_at_null_change_no_bit(without: np.ndarray) -> None:
    nulls = [effect() for effect in IN_CELL]
    if not np.array_equal(_trajectory(nulls, STEPS), without):
        culprits = [
            e for e in nulls if not np.array_equal(_trajectory([e], STEPS), without)
        ]
        pytest.fail(f"changed by {culprits or 'several together'}")


@pytest.mark.parametrize("effect", IN_CELL)
def test_shows_away_from_null(effect: type[ef.Effect], without, tmp_path: Path) -> None:
    fields = {f.name: f for f in dataclasses.fields(effect)}
    sized = {
        name: 0.05 * fields[name].metadata["high"] for name in ef.amplitudes(effect)
    }
    if effect is ef.SensorResidualModel:
        sized["file"] = str(step_in_fy(tmp_path))
    model = "hydroelastic"
    if effect is ef.ContactExponent:
        model, refused = "impact", effect(**sized)
        assert "ContactExponent" in refusal(_trajectory, [refused], 1)
        without = _trajectory([], STEPS, model)
    assert not np.allclose(
        _trajectory([effect(**sized)], STEPS, model), without, atol=1e-6
    )


@pytest.mark.parametrize("rpy", [(np.pi, 0, 0), (0.3, -0.8, 2.0)])
def test_payload_error_is_a_hanging_mass(rpy: tuple[float, float, float]) -> None:
    sensing, p_SoScm_S = _sensing(rpy), np.array([0.01, -0.02, 0.1])
    read = ef.PayloadError(0.3, *(0.3 * p_SoScm_S)).apply(np.zeros(6), sensing)
    f_W = sensing.R_WS @ read[:3]
    np.testing.assert_allclose(f_W, [0, 0, -0.3 * 9.81], atol=1e-12)
    np.testing.assert_allclose(read[3:], np.cross(p_SoScm_S, read[:3]), atol=1e-12)


def test_drift_grows_and_warm_up_settles() -> None:
    for time in (0.0, 2.0, 1e4):
        sensing = _sensing((0, 0, 0), time)
        drift = ef.SensorDrift(fz=0.1, tx=-0.01).apply(np.zeros(6), sensing)
        np.testing.assert_allclose(drift[2:4], [0.1 * time, -0.01 * time])
        warm = ef.SensorWarmUp(fz=2.0, time_constant=2.0).apply(np.zeros(6), sensing)
        assert warm[2] == pytest.approx(2.0 * (1 - np.exp(-time / 2.0)))
    for late in (ef.SensorDrift, ef.SensorWarmUp, ef.SensorBias):
        assert not late.present_at_zeroing


def test_gain_cross_talk_and_mounting_are_their_matrices() -> None:
    """A sensor turned a quarter about z: its x axis is where y_S was."""
    wrench, still = np.arange(1.0, 7.0), _sensing((0, 0, 0))
    np.testing.assert_allclose(
        ef.SensorGain(fy=0.1, tz=-0.5).apply(wrench, still), [1, 2.2, 3, 4, 5, 3]
    )
    mixed = ef.SensorCrossTalk(fx_ty=0.2, tz_fy=-0.05).apply(wrench, still)
    np.testing.assert_allclose(mixed, [1 + 0.2 * 5, 2, 3, 4, 5, 6 - 0.05 * 2])
    wrench = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    read = ef.SensorMounting(rz=np.pi / 2).apply(wrench, _sensing((0, 0, 0)))
    np.testing.assert_allclose(read, [2, -1, 3, 5, -4, 6], atol=1e-12)


def test_the_chain_goes_from_the_load_to_the_electronics() -> None:
    """A bias that is listed first still acts behind the gain."""
    listed = [ef.SensorBias(fz=1.0), ef.SensorGain(fz=1.0), ef.PayloadError(mass=-1.0)]
    kinds = [type(effect) for effect in ef.sensor_chain(listed)]
    assert kinds == [ef.PayloadError, ef.SensorGain, ef.SensorBias]


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (ef.JointViscousFriction(coefficient=2.0), [-1.0, 0.0, 4.0]),
        (ef.JointCoulombFriction(size=3.0, creep=0.001), [-3.0, 0.0, 3.0]),
        (ef.JointStribeckFriction(size=3.0, speed=2.0, creep=0.001),
         [-3 * np.exp(-1 / 16), 0.0, 3 * np.exp(-1)]),
        (ef.JointAsymmetricFriction(coulomb=1.0, viscous=2.0, creep=0.001),
         [2.0, 0.0, 5.0]),
        (ef.JointLoadFriction(coefficient=0.1, creep=0.001), [-1.0, 0.0, 3.0]),
        (ef.JointQuadraticFriction(coefficient=0.1, creep=0.001), [-10.0, 0.0, 90.0]),
        (ef.TorqueOffset(size=-0.7), [-0.7, -0.7, -0.7]),
        (ef.TorqueGain(share=0.1), [1.0, -2.0, 3.0]),
        (ef.RotorInertia(inertia=2.0), [2.0, -2.0, 6.0]),
    ],
)  # fmt: skip
def test_arm_effects_are_their_equations(
    effect: ef.JointEffect, expected: list
) -> None:
    np.testing.assert_allclose(effect.torque(SAMPLES), expected, atol=1e-12)


def test_groove_friction_and_pose() -> None:
    assert ef.GrooveFriction(0.15).apply(ENVIRONMENT, ef.AT_REST).friction == 0.2 + 0.15
    assert ef.GrooveFriction(-0.5).apply(ENVIRONMENT, ef.AT_REST).friction == 0.0
    nominal = dataclasses.replace(ENVIRONMENT, X_GnG=RigidTransform())
    X_GnG = ef.GroovePose(ry=0.1, x=0.001, z=0.002).apply(nominal, ef.AT_REST).X_GnG
    np.testing.assert_allclose(X_GnG.translation(), [0.001, 0, 0.002])
    end = X_GnG.rotation() @ np.array([0.06, 0, 0])
    expected = 0.06 * np.array([np.cos(0.1), 0, -np.sin(0.1)])
    np.testing.assert_allclose(end, expected, atol=1e-12)


def test_imprecision_scatters_about_the_command_and_repeats_itself():
    effect = ef.Imprecision(x=1e-3, z=5e-4)
    command, memory, away = np.zeros(6), np.zeros(6), []
    for _ in range(2000):
        executed, memory = effect.execute(command, np.zeros(6), memory, 0.1)
        away.append(executed - command)
    assert np.array_equal(
        effect.execute(command, np.zeros(6), np.zeros(6), 0.1)[0], away[0]
    )
    np.testing.assert_allclose(
        np.std(away, axis=0), [1e-3, 0, 5e-4, 0, 0, 0], rtol=0.05
    )
    np.testing.assert_allclose(np.mean(away, axis=0), 0.0, atol=8e-5)
