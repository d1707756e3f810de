"""Effects: declared in full, nothing at their null values, their equation else."""

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from drake_disasm.effects import (
    EFFECTS,
    Effect,
    Environment,
    EnvironmentEffect,
    GrooveFriction,
    GroovePose,
    PayloadError,
    Sensing,
    SensorBias,
    SensorEffect,
)
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation, SimulatedStation, TwinStation
from drake_disasm.task.simulation import TaskSimulation

G_W = np.array([0.0, 0.0, -9.81])
ORIENTATIONS = [(0, 0, 0), (np.pi, 0, 0), (0.3, -0.8, 2.0), (np.pi / 2, 0, 0)]
ENVIRONMENT = Environment(RigidTransform([0.001, 0, 0]), 0.2, 1e9, 1e8, 20.0)


def _sensing(rpy: tuple[float, float, float], time: float = 1.0) -> Sensing:
    return Sensing(time, RollPitchYaw(np.array(rpy)).ToRotationMatrix(), G_W)


@pytest.mark.parametrize("effect", EFFECTS)
def test_is_declared_in_full(effect: type[Effect]) -> None:
    assert "Equation:" in (effect.__doc__ or "")
    assert "Where it acts:" in (effect.__doc__ or "")
    for field in dataclasses.fields(effect):  # type: ignore[arg-type]
        data = field.metadata
        assert data["unit"] and data["doc"]
        assert field.default == 0.0
        assert data["low"] < 0.0 < data["high"]


@pytest.mark.parametrize("effect", EFFECTS)
def test_vanishes_at_null_as_a_function(effect: type[Effect]) -> None:
    null = effect()
    if isinstance(null, EnvironmentEffect):
        changed = null.apply(ENVIRONMENT)
        assert changed.X_GnG.IsExactlyEqualTo(ENVIRONMENT.X_GnG)
        assert dataclasses.replace(changed, X_GnG=ENVIRONMENT.X_GnG) == ENVIRONMENT
    if isinstance(null, SensorEffect):
        wrench = np.array([1.1, -2.2, 3.3, 0.1, -0.2, 0.3])
        read = null.apply(wrench, _sensing((0.3, -0.8, 2.0)))
        assert np.array_equal(read, wrench)


def _trajectory(effects: list[Effect], steps: int) -> np.ndarray:
    """An episode in contact: the groove is turned and rubs."""
    scenario = load_scenario("removal_turned")
    scenario.effects = [*scenario.effects, *effects]
    simulation = TaskSimulation(scenario, "twin", make_policy("straight"))
    simulation.reset(7)
    return np.array([simulation.step().observation for _ in range(steps)])


@pytest.fixture(scope="module")
def without() -> np.ndarray:
    """The trajectory without the effect."""
    return _trajectory([], 20)


@pytest.mark.parametrize("effect", EFFECTS)
def test_vanishes_at_null_bit_for_bit(
    effect: type[Effect], without: np.ndarray
) -> None:
    assert np.array_equal(_trajectory([effect()], 20), without)


@pytest.mark.parametrize("effect", EFFECTS)
def test_shows_away_from_null(effect: type[Effect], without: np.ndarray) -> None:
    values = {f.name: 5e-4 for f in dataclasses.fields(effect)}  # type: ignore[arg-type]
    with_effect = _trajectory([effect(**values)], 20)
    assert not np.allclose(with_effect, without, atol=1e-6)


@pytest.mark.parametrize("rpy", ORIENTATIONS)
def test_payload_error_is_a_hanging_mass(rpy: tuple[float, float, float]) -> None:
    sensing, mass = _sensing(rpy), 0.3
    p_SoScm_S = np.array([0.01, -0.02, 0.1])
    c = mass * p_SoScm_S
    effect = PayloadError(mass, *c)
    read = effect.apply(np.zeros(6), sensing)
    f_W = sensing.R_WS @ read[:3]
    np.testing.assert_allclose(f_W, [0, 0, -0.3 * 9.81], atol=1e-12)
    np.testing.assert_allclose(read[3:], np.cross(p_SoScm_S, read[:3]), atol=1e-12)


def test_sensor_bias_adds_and_zeroing_does_not_see_it() -> None:
    bias = np.array([0.5, -1, 2, 0.1, 0.2, -0.3])
    read = SensorBias(*bias).apply(np.ones(6), _sensing((1, 2, 3)))
    np.testing.assert_array_equal(read, 1 + bias)
    assert not SensorBias.present_at_zeroing
    assert PayloadError.present_at_zeroing


def test_groove_friction_adds_and_stops_at_zero() -> None:
    assert GrooveFriction(0.15).apply(ENVIRONMENT).friction == 0.2 + 0.15
    assert GrooveFriction(-0.5).apply(ENVIRONMENT).friction == 0.0


def test_groove_pose_turns_about_a_and_shifts() -> None:
    nominal = dataclasses.replace(ENVIRONMENT, X_GnG=RigidTransform())
    X_GnG = GroovePose(ry=0.1, x=0.001, z=0.002).apply(nominal).X_GnG
    np.testing.assert_allclose(X_GnG.translation(), [0.001, 0, 0.002])
    end = X_GnG.rotation() @ np.array([0.06, 0, 0])
    expected = 0.06 * np.array([np.cos(0.1), 0, -np.sin(0.1)])
    np.testing.assert_allclose(end, expected, atol=1e-12)


@pytest.mark.parametrize("station_type", [CellStation, TwinStation])
def test_groove_pose_moves_body_and_geometry(
    station_type: type[SimulatedStation],
) -> None:
    station = station_type(load_scenario("removal"))
    context = station.CreateDefaultContext()
    query = station.GetOutputPort("query_object")
    geometry = station.lock.groove_ids[0]
    before = RigidTransform(query.Eval(context).GetPoseInWorld(geometry))
    effect = GroovePose(ry=0.05, y=0.003)
    station.set_effects(context, [effect])
    X_GnG = effect.apply(station.lock.nominal).X_GnG
    assert station.true_groove_pose(context).IsExactlyEqualTo(X_GnG)
    after = query.Eval(context).GetPoseInWorld(geometry)
    X_WG = station.X_WG
    expected = X_WG @ X_GnG @ X_WG.inverse() @ before
    assert after.IsNearlyEqualTo(expected, 1e-12)
