"""Effects on the arm in the cell, against their own equations and statics."""

from collections.abc import Sequence

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from drake_disasm import effects as fx
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refused

LIFT = np.array([0, -0.3, 0, 0, 0, 0, 0])  # rad, of the arm out of the lock
JOINT = 3  # carries much of the weight
NAME = "iiwa_joint_4"
SPEED = 0.1  # rad/s


@pytest.fixture(scope="module")
def station() -> CellStation:
    period = "arm.control_period=0.0025"  # else the command is a staircase to it
    return CellStation(load_scenario("removal", [QUIET, "gripper.hold=weld", period]))


def _lifted(station: CellStation, effects: Sequence[fx.Effect]) -> Simulator:
    """Returns the station with the arm raised, so that nothing touches the bolt."""
    simulator = station.at_start(effects)
    context = simulator.get_mutable_context()
    plant_context = station.part_context(station.plant, context)
    q = station.start + LIFT
    station.plant.SetPositions(plant_context, station.arm_instance, q)
    station.GetInputPort("iiwa.position").FixValue(context, q)
    simulator.Initialize()
    return simulator


def _drive(station: CellStation, simulator: Simulator, q: np.ndarray) -> np.ndarray:
    """Commands one joint (steps,) beside its place; returns its torques (steps,)."""
    context, torques = simulator.get_mutable_context(), []
    for k, place in enumerate(q):
        command = station.start + LIFT
        command[JOINT] += place
        station.GetInputPort("iiwa.position").FixValue(context, command)
        simulator.AdvanceTo((k + 1) * station.control_period)
        torque = station.GetOutputPort("iiwa.torque_measured").Eval(context)
        torques.append(torque[JOINT])
    return np.array(torques)


def _forth_and_back(station: CellStation, effects: Sequence[fx.Effect]) -> np.ndarray:
    """Returns a joint's torque after 0.4 s at steady speed, forwards and backwards."""
    t = station.control_period * np.arange(1, 161)
    torques = [
        _drive(station, _lifted(station, effects), v * t)[-1] for v in (SPEED, -SPEED)
    ]
    return np.array(torques)


@pytest.fixture(scope="module")
def without(station: CellStation) -> np.ndarray:
    return _forth_and_back(station, [])


@pytest.mark.parametrize("effect", [
    fx.JointViscousFriction(NAME, 80.0),
    fx.JointCoulombFriction(NAME, 9.0, creep=1e-4),
    fx.JointStribeckFriction(NAME, 12.0, speed=0.15),
    fx.JointAsymmetricFriction(NAME, 4.0, viscous=30.0),
    fx.JointLoadFriction(NAME, 0.2),
])  # fmt: skip
def test_a_joint_at_steady_speed_takes_the_effects_torque(effect, station, without):
    v = np.array([SPEED, -SPEED])
    expected = effect.torque(fx.JointSamples(0 * v, v, 0 * v, without))
    measured = _forth_and_back(station, [effect])
    np.testing.assert_allclose(measured - without, expected, atol=0.03)


def test_friction_does_not_chatter_when_the_joint_comes_to_rest(station):
    """However sharp and strong: the torque falls evenly, it does not jump about."""
    simulator = _lifted(station, [fx.JointCoulombFriction(NAME, 30.0, creep=1e-4)])
    ramp = SPEED * station.control_period * np.arange(1, 81)
    torques = _drive(station, simulator, np.append(ramp, np.full(200, ramp[-1])))
    assert np.abs(np.diff(torques[-150:], 2)).max() < 0.01


def test_pre_sliding_friction_follows_the_path(station: CellStation) -> None:
    """Dahl's closed form along the joint's path, through reversals ever smaller."""
    effect = fx.JointDahlFriction(NAME, 6.0, 0.002)
    t = station.control_period * np.arange(1, 201)
    simulator = _lifted(station, [effect])
    context, path = simulator.get_mutable_context(), [_joint(station, simulator)]
    simulator.set_monitor(lambda _: path.append(_joint(station, simulator)))
    _drive(station, simulator, 0.01 * np.exp(-4.0 * t) * np.sin(24.0 * t))
    force = station.GetSubsystemByName("arm_friction").get_output_port()
    forces = force.Eval(station.part_context(force.get_system(), context))
    expected = effect.torque(effect.along(np.array(path)))
    assert 0.1 < abs(expected[-1]) < 5.9
    assert np.abs(forces + expected[-1]).min() < 1e-6


def _joint(station: CellStation, simulator: Simulator) -> float:
    """Returns where the joint truly is."""
    context = simulator.get_mutable_context()
    plant_context = station.part_context(station.plant, context)
    return float(station.plant.GetPositions(plant_context, station.arm_instance)[JOINT])


def test_a_spring_is_held_by_the_drive(station: CellStation) -> None:
    effect = fx.JointSpring(NAME, stiffness=30.0)
    torques = []
    for effects in ([], [effect]):
        simulator = _lifted(station, effects)
        simulator.AdvanceTo(0.6)
        context = simulator.get_mutable_context()
        torques.append(station.GetOutputPort("iiwa.torque_measured").Eval(context))
    expected = np.zeros(7)
    expected[JOINT] = 30.0 * _joint(station, simulator)
    np.testing.assert_allclose(torques[1] - torques[0], expected, atol=0.05)


@pytest.mark.parametrize("control", ["position", "cartesian_impedance"])
def test_an_arm_goes_where_its_encoders_read_the_command(control: str) -> None:
    scenario = load_scenario("removal", [QUIET, "gripper.hold=weld"])
    scenario.arm.control = control
    station = CellStation(scenario)
    effect = fx.EncoderError(NAME, offset=0.004, scale=-0.003)
    simulator = _lifted(station, [effect])
    simulator.AdvanceTo(0.8)
    context = simulator.get_mutable_context()
    true, command = _joint(station, simulator), (station.start + LIFT)[JOINT]
    read = station.GetOutputPort("iiwa.position_measured").Eval(context)[JOINT]
    assert read == pytest.approx(true + effect.off(true, 0.0)[0], abs=1e-12)
    assert read == pytest.approx(command, abs=1e-3)
    assert true - command == pytest.approx(-0.004 + 0.003 * command, abs=1e-3)


def test_a_rotor_takes_torque_while_it_speeds_up(station: CellStation) -> None:
    """2 kg m^2 at 0.5 rad/s^2 are 1 N m; at the first instants, near one place."""
    t = station.control_period * np.arange(1, 121)
    q = 0.25 * t**2
    slow, fast = (
        _drive(station, _lifted(station, effects), q)[-20:].mean()
        for effects in ([], [fx.RotorInertia(NAME, 2.0)])
    )
    assert fast - slow == pytest.approx(1.0, abs=0.01)


def test_a_payload_bends_the_joints(station: CellStation) -> None:
    """At rest: k (q_commanded - q) = J^T m g, which nothing compensates."""
    mass, p_FoPcm_F = 2.0, np.array([0.02, -0.05, 0.1])
    simulator = _lifted(station, [fx.FlangePayload(mass, *(mass * p_FoPcm_F))])
    simulator.AdvanceTo(0.6)
    plant = station.plant
    context = station.part_context(plant, simulator.get_mutable_context())
    J_W = plant.CalcJacobianTranslationalVelocity(
        context, JacobianWrtVariable.kV, plant.GetFrameByName("iiwa_link_ee"),
        p_FoPcm_F, plant.world_frame(), plant.world_frame(),
    )  # fmt: skip
    yielded = station.start + LIFT - plant.GetPositions(context, station.arm_instance)
    weight = J_W.T @ [0.0, 0.0, 9.81 * mass]
    k = np.array(station.scenario.arm.stiffness)
    np.testing.assert_allclose(k * yielded, weight[:7], atol=0.01)
    assert np.abs(yielded).max() > 1e-3


def _parameters(station: CellStation, context: Context) -> np.ndarray:
    """Returns all numbers that effects on the arm may change."""
    systems = ("arm_friction", "arm_torque_sensor", "arm_encoders")
    named = [station.GetSubsystemByName(f"{name}_parameters") for name in systems]
    contexts = [station.part_context(part, context) for part in (station.plant, *named)]
    return np.concatenate(
        [
            each.get_numeric_parameter(i).CopyToVector()
            for each in contexts
            for i in range(each.num_numeric_parameter_groups())
        ]
    )


EVERY = (
    fx.JointViscousFriction(NAME, 80.0),
    fx.JointCoulombFriction(NAME, 9.0),
    fx.JointStribeckFriction(NAME, 12.0),
    fx.JointAsymmetricFriction(NAME, 4.0, viscous=30.0),
    fx.JointLoadFriction(NAME, 0.2),
    fx.RotorInertia(NAME, 2.0),
    fx.TorqueOffset(NAME, -2.0),
    fx.TorqueGain(NAME, 0.1),
    fx.JointDahlFriction(NAME, 6.0),
    fx.JointSpring(NAME, 30.0),
    fx.EncoderError(NAME, 0.004, -0.003),
    fx.FlangePayload(2.0, 0.1),
)
NULL = (
    *(type(e)(NAME) for e in EVERY if hasattr(e, "joint")),
    fx.FlangePayload(),
)


def test_each_effect_changes_the_arm_which_the_twin_has_not_and_none_stays(
    station, twin
):
    context = station.CreateDefaultContext()
    station.set_effects(context, [])
    nominal = _parameters(station, context)
    for effect in EVERY:
        station.set_effects(context, [effect])
        found = _parameters(station, context)  # NaN: the world's mass
        assert not np.array_equal(found, nominal, equal_nan=True), effect
        with refused("acts on the arm", "cell"):
            twin.set_effects(twin.CreateDefaultContext(), [effect])
    for after in ((), NULL):
        station.set_effects(context, EVERY)
        found = _parameters(station, context)
        changed = ~np.isclose(found, nominal, 0, 0, equal_nan=True)
        assert changed.sum() >= len(EVERY)
        station.set_effects(context, after)
        np.testing.assert_array_equal(_parameters(station, context), nominal)


@pytest.mark.parametrize(("effects", "words"), [
    ([fx.TorqueOffset("iiwa_join_4", 1.0)], ["did you mean 'iiwa_joint_4'"]),
    ([fx.RotorInertia("iiwa_join_4", 1.0)], ["did you mean 'iiwa_joint_4'"]),
    ([fx.EncoderError("iiwa_join_4", 1.0)], ["did you mean 'iiwa_joint_4'"]),
    ([fx.JointLoadFriction(NAME, 0.1)] * 2, ["twice on iiwa_joint_4", "merge"]),
    ([fx.FlangePayload(cx=0.1)], ["no mass", "give it a mass"]),
])  # fmt: skip
def test_refuses_what_the_cell_cannot_carry(effects, words, station):
    with refused(*words):
        station.set_effects(station.CreateDefaultContext(), effects)


def test_a_torque_sensor_reads_what_its_effects_say(station: CellStation) -> None:
    """Only the reading is wrong: the arm holds still as before."""
    effects = [fx.TorqueOffset(NAME, -2.0), fx.TorqueGain(NAME, 0.1)]
    context = _lifted(station, effects).get_mutable_context()
    true, read = (
        station.GetOutputPort(f"iiwa.torque_{end}").Eval(context)
        for end in ("commanded", "measured")
    )
    expected = true.copy()
    expected[JOINT] = 1.1 * true[JOINT] - 2.0
    np.testing.assert_allclose(read, expected)
    station.set_effects(context, [])
    read = station.GetOutputPort("iiwa.torque_measured").Eval(context)
    np.testing.assert_array_equal(read, true)
