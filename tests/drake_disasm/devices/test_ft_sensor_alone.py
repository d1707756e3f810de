"""The sensor system by itself: made-up reactions in, readings out."""

import numpy as np
from pydrake.common import RandomGenerator
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.framework import Context

from drake_disasm.common.ports import Health
from drake_disasm.devices.ft_sensor import ForceTorqueSensor, quantise
from drake_disasm.devices.load_source import JointReaction
from drake_disasm.devices.sensor_chain import Payload
from drake_disasm.effects import PayloadError, Sensing, SensorBias, SensorEffect
from drake_disasm.scenario import SensorConfig, load_scenario
from drake_disasm.task.simulation import TaskSimulation

G_W = np.array([0.0, 0.0, -9.81])
LOAD = np.array([1.0, -2.0, 3.0, 0.1, -0.2, 0.3])  # [f; tau] on the sensor, in S
R_BODY_S = RollPitchYaw(0.1, 0.2, 0.3).ToRotationMatrix()
R_W_BODY = RollPitchYaw(-0.5, 0.4, 1.0).ToRotationMatrix()


def _weld() -> tuple[WeldJoint, Frame]:
    """The third joint's weld, joint 0 being removed, and S, on body 1."""
    plant, X_BodyS = MultibodyPlant(0.0), RigidTransform(R_BODY_S, [1, 2, 3])
    one, other, last = (plant.AddRigidBody(n, SpatialInertia.Zero()) for n in "abc")
    world = plant.world_frame()
    removed = plant.WeldFrames(world, last.body_frame())
    plant.RemoveJoint(removed)
    plant.WeldFrames(world, other.body_frame())
    plant.WeldFrames(world, last.body_frame())
    frame_S = plant.AddFrame(FixedOffsetFrame("S", one.body_frame(), X_BodyS))
    return plant.WeldFrames(world, frame_S), frame_S


def _sensor(
    noise: float = 0.0, quantum: float = 0.0, load: np.ndarray = LOAD
) -> tuple[ForceTorqueSensor, Context]:
    """A sensor at a weld, whose reaction is minus the load."""
    config = SensorConfig(noise=[noise] * 6, quantum=[quantum] * 6)
    source = JointReaction(*_weld())
    sensor = ForceTorqueSensor(
        config, source, Payload(0.0, np.zeros(3), G_W), time_step=0.25
    )
    context = sensor.CreateDefaultContext()
    other = SpatialForce(tau=[9, 9, 9], f=[9, 9, 9])
    reaction = SpatialForce(tau=-load[3:], f=-load[:3])
    forces = Value[list[SpatialForce]]([other, other, reaction])
    poses = Value[list[RigidTransform]]([RigidTransform(), RigidTransform(R_W_BODY)])
    sensor.GetInputPort("reaction_forces").FixValue(context, forces)
    sensor.GetInputPort("body_poses").FixValue(context, poses)
    sensor.GetInputPort("noise").FixValue(context, np.array([1, 2, 3, -1, -2, -3.0]))
    return sensor, context


def _reading(sensor: ForceTorqueSensor, context: Context) -> np.ndarray:
    return sensor.GetOutputPort("wrench").Eval(context)


def test_reading_is_minus_the_reaction_with_noise_in_whole_counts() -> None:
    np.testing.assert_array_equal(_reading(*_sensor()), LOAD)
    expected = LOAD + 0.1 * np.array([1, 2, 3, -1, -2, -3])
    np.testing.assert_allclose(_reading(*_sensor(noise=0.1)), expected)
    sensor, context = _sensor(noise=0.1, quantum=0.5)
    np.testing.assert_array_equal(sensor.reading_at_zeroing(context), LOAD)
    reading = _reading(*_sensor(quantum=0.07))
    assert np.abs(reading - LOAD).max() <= 0.07 / 2 + 1e-12
    np.testing.assert_allclose(reading / 0.07, np.round(reading / 0.07), atol=1e-12)
    values = np.array([0.123, 0.123, -0.5])
    quantum = np.array([0.0, 0.1, 0.2])
    np.testing.assert_allclose(quantise(values, quantum), [0.123, 0.1, -0.4])


def test_health() -> None:
    loads = ((np.zeros(6), Health.NO_DATA), (np.eye(6)[4], Health.READY))
    for load, health in loads:
        sensor, context = _sensor(load=load)
        assert sensor.GetOutputPort("health").Eval(context)[0] == health


def test_effects_see_the_orientation_and_zeroing_the_payload() -> None:
    sensor, context = _sensor()
    sensor.set_effects(context, [PayloadError(mass=0.5, cz=0.05)])
    g_S = (R_W_BODY @ R_BODY_S).matrix().T @ G_W
    expected = LOAD + np.concatenate([0.5 * g_S, np.cross([0, 0, 0.05], g_S)])
    np.testing.assert_allclose(_reading(sensor, context), expected, atol=1e-14)
    sensor, context = _sensor()
    sensor.set_effects(context, [SensorBias(fx=1.0), PayloadError(mass=0.5)])
    g_S = (R_W_BODY @ R_BODY_S).matrix().T @ G_W
    expected = LOAD + np.concatenate([0.5 * g_S, np.zeros(3)])
    np.testing.assert_allclose(sensor.reading_at_zeroing(context), expected, atol=1e-14)


class _Doubling(SensorEffect):
    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        return 2.0 * wrench_S


def test_effects_act_in_their_order_and_belong_to_the_context() -> None:
    """Two Contexts of one sensor, as two episodes side by side have."""
    sensor, context = _sensor()
    bias = SensorBias(fx=1.0)
    sensor.set_effects(context, [bias, _Doubling()])
    assert _reading(sensor, context)[0] == 2.0 * (LOAD[0] + 1.0)
    sensor.set_effects(context, [_Doubling(), bias])
    assert _reading(sensor, context)[0] == 2.0 * LOAD[0] + 1.0
    sensor, biased = _sensor()
    clean = biased.Clone()
    sensor.set_effects(biased, [SensorBias(fx=1.0)])
    np.testing.assert_array_equal(_reading(sensor, clean), LOAD)
    assert _reading(sensor, biased)[0] == LOAD[0] + 1.0


class _Drift(SensorEffect):
    """A reading that grows with time."""

    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        return wrench_S + sensing.time


def test_time_is_that_of_the_newest_step_for_effects_too() -> None:
    """And zero when the sensor is zeroed."""
    for now, sampled in ((1.25, 1.25), (1.30, 1.25), (1.5, 1.5)):
        sensor, context = _sensor()
        sensor.set_effects(context, [_Drift()])
        context.SetTime(now)
        assert sensor.GetOutputPort("time_measured").Eval(context)[0] == sampled
        np.testing.assert_array_equal(_reading(sensor, context), LOAD + sampled)
    np.testing.assert_array_equal(sensor.reading_at_zeroing(context), LOAD)


def test_noise_has_the_stated_variance_and_no_mean() -> None:
    """(n - 1) s^2 / sigma^2 is chi-square: n - 1 +- 4 sqrt(2 (n - 1))."""
    simulation = TaskSimulation(
        load_scenario("removal", ["ft_sensor.quantum=[0, 0, 0, 0, 0, 0]"]), "twin"
    )
    station, n = simulation.station, 3000
    simulation.reset(0)
    generator, readings = RandomGenerator(5), np.empty((n, 6))
    for i in range(n):
        mine = station.sensor_noise.GetMyMutableContextFromRoot(simulation.context)
        station.sensor_noise.SetRandomContext(mine, generator)
        readings[i] = simulation.evaluate(station, "ft_sensor.wrench")
    sigma = np.array(simulation.scenario.ft_sensor.noise)
    correlation = np.corrcoef(readings.T) - np.eye(6)
    assert np.abs(correlation).max() < 5.0 / np.sqrt(n)
    statistic = (n - 1) * readings.var(axis=0, ddof=1) / sigma**2
    assert np.all(np.abs(statistic - (n - 1)) < 4.0 * np.sqrt(2.0 * (n - 1)))
    context = station.GetMyMutableContextFromRoot(simulation.context)
    mean = readings.mean(axis=0) - station.reading_at_zeroing(context)
    assert np.all(np.abs(mean) < 4.0 * sigma / np.sqrt(n))


def test_noise_is_held_between_samples() -> None:
    """A new draw every `ft_sensor.period`, here twice per step of the MDP."""
    simulation = TaskSimulation(
        load_scenario("removal", ["ft_sensor.period=0.05"]), "twin"
    )
    simulation.reset(0)
    noise, station = simulation.station.sensor_noise, simulation.station
    draws = []
    for k in range(1, 21):
        simulation.simulator.AdvanceTo(0.01 * k + 0.002)
        draws.append(simulation.evaluate(noise, noise.get_output_port().get_name())[0])
    assert len(set(draws)) == 5  # samples at 0, 0.05, 0.10, 0.15, 0.20
    assert simulation.evaluate(station, "ft_sensor.health")[0] == Health.READY
