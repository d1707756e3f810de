"""A station's default Context is the start of the task, in any diagram."""

from collections.abc import Callable

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_disasm import effects as fx
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import SimulatedStation, TwinStation, make_station
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refused

JOINT = "iiwa_joint_4"
ANYWHERE: list[fx.Effect] = [
    fx.GroovePose(ry=0.03, z=3e-4),
    fx.GrooveFriction(0.2),
    fx.GrooveClearance(1e-4),
    fx.ChainPull(fx=-2.0),
    fx.SensorBias(fx=1.0),
    fx.SensorLag(share=0.8, time_constant=0.2),
    fx.PayloadError(mass=0.1),
]
ON_ARM: list[fx.Effect] = [
    fx.JointViscousFriction(JOINT, 80.0),
    fx.JointCoulombFriction(JOINT, 9.0),
    fx.JointDahlFriction(JOINT, 6.0),
    fx.JointSpring(JOINT, 10.0),
    fx.EncoderError(JOINT, 1e-4, 1e-4),
    fx.RotorInertia(JOINT, 2.0),
    fx.TorqueOffset(JOINT, -2.0),
    fx.FlangePayload(0.3, 0.01, 0.0, 0.02),
]


def numbers(context: Context) -> np.ndarray:
    """Returns all of a Context's time, discrete state and numeric parameters."""
    state = [
        context.get_discrete_state(i).value()
        for i in range(context.num_discrete_state_groups())
    ]
    parameters = [
        context.get_numeric_parameter(i).CopyToVector()
        for i in range(context.num_numeric_parameter_groups())
    ]
    return np.concatenate([[context.get_time()], *state, *parameters])


def _scenario(effects: list[fx.Effect], *overrides: str) -> Scenario:
    scenario = load_scenario("removal_turned", [QUIET, *overrides])
    scenario.effects = [*scenario.effects, *effects]
    return scenario


def _simulated(station: SimulatedStation) -> Simulator:
    """Returns the program of a user who never heard of TaskSimulation."""
    builder = DiagramBuilder()
    builder.AddSystem(station)
    commands = {f"{station.arm}.position": station.start}
    if station.grip_command is not None:
        commands["gripper.position"] = np.array([station.grip_command])
    for name, value in commands.items():
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), station.GetInputPort(name))
    simulator = Simulator(builder.Build())
    station.attach(simulator)  # a chain's pull depends on where the bolt is
    return simulator


STATIONS: dict[str, Callable[[], SimulatedStation]] = {
    "twin": lambda: make_station("twin", _scenario(ANYWHERE)),
    "impact": lambda: make_station("twin", _scenario(ANYWHERE, "contact.model=impact")),
    "cell": lambda: make_station("cell", _scenario([*ANYWHERE, *ON_ARM])),
}


@pytest.fixture(scope="module", params=STATIONS)
def simulator(request: pytest.FixtureRequest) -> Simulator:
    return _simulated(STATIONS[request.param]())


@pytest.fixture
def station(simulator: Simulator) -> SimulatedStation:
    systems = simulator.get_system().GetSystems()
    return next(each for each in systems if isinstance(each, SimulatedStation))


def test_begin_and_the_scenarios_effects_leave_it_and_come_back_to_it(station):
    """What is declared at construction is what `set_effects` writes."""
    context = station.CreateDefaultContext()
    default = numbers(context)
    begun = station.begin(context)
    np.testing.assert_array_equal(numbers(context), default)
    np.testing.assert_array_equal(begun.reading, station.initial_state.reading)
    np.testing.assert_array_equal(begun.position, station.start)
    station.set_effects(context, [])
    assert not np.array_equal(numbers(context), default, equal_nan=True)
    station.set_effects(context, station.scenario.effects)
    np.testing.assert_array_equal(numbers(context), default)
    plant = station.part_context(station.plant, context)
    station.plant.SetVelocities(plant, np.ones(station.plant.num_velocities()))
    station.set_effects(context, [])
    station.begin(context, list(station.scenario.effects))
    np.testing.assert_array_equal(numbers(context), default)


def test_groove_and_materials_are_the_effects(station: SimulatedStation) -> None:
    context = station.CreateDefaultContext()
    effects = station.scenario.effects
    expected = fx.environment_at(station.lock.environment, effects, fx.AT_REST)
    assert station.true_groove_pose(context).IsExactlyEqualTo(expected.X_GnG)
    inspector = station.GetOutputPort("query_object").Eval(context).inspector()
    for geometry in (*station.lock.groove_ids, *station.lock.bolt_ids.values()):
        properties = inspector.GetProximityProperties(geometry)
        friction = properties.GetProperty("material", "coulomb_friction")
        assert friction.static_friction() == expected.friction


def _slot(station: SimulatedStation, effects: list[fx.Effect] | None) -> float:
    """Returns the width between the lips [m] as the scene graph has it."""
    context = station.CreateDefaultContext()
    if effects is not None:
        station.set_effects(context, effects)
    inspector = station.GetOutputPort("query_object").Eval(context).inspector()
    left, right = (
        (inspector.GetPoseInFrame(i), inspector.GetShape(i))
        for i in station.lock.groove_ids[:2]
    )
    apart = left[0].translation()[2] - right[0].translation()[2]
    return float(apart - (left[1].height() + right[1].height()) / 2)


def test_the_slot_is_as_wide_as_the_effects_say(twin: TwinStation) -> None:
    """By default, after a change, and after the change is gone."""
    nominal = _slot(twin, None)
    wider = TwinStation(_scenario([fx.GrooveClearance(1e-4)]))
    assert _slot(wider, None) == pytest.approx(nominal + 1e-4)
    assert _slot(wider, []) == pytest.approx(nominal)
    assert _slot(twin, [fx.GrooveClearance(1e-4)]) == pytest.approx(nominal + 1e-4)


def test_it_stays_at_the_start_in_a_users_diagram(simulator, station):
    """Gripped at A, at rest, zeroed."""
    context = station.GetMyContextFromRoot(simulator.get_context())
    ports = [station.GetOutputPort(name) for name in ("bolt_pose", "ft_sensor.wrench")]
    before, reading = (port.Eval(context) for port in ports)
    simulator.AdvanceTo(0.2)
    after, later = (port.Eval(context) for port in ports)
    away = (before.inverse() @ after).translation()
    assert np.linalg.norm(away) < 1e-4  # the pads creep under the pull
    assert np.all(np.abs(later - reading) < [0.2, 0.2, 0.2, 0.05, 0.05, 0.05])
    position = station.GetOutputPort(f"{station.arm}.position_measured").Eval(context)
    np.testing.assert_allclose(position, station.start, atol=2e-3)

    # The first reading is of the load at rest, not of the zeros that a plant's
    # reactions are before its first step: to half a count, and to the motion's rest.
    context = station.CreateDefaultContext()
    reading = station.GetOutputPort("ft_sensor.wrench").Eval(context)
    bias = np.array([1.0, 0, 0, 0, 0, 0])  # which comes up after zeroing
    expected = station.initial_state.reading + bias
    quantum = np.array(station.scenario.ft_sensor.quantum)
    assert np.all(np.abs(reading - expected) <= quantum / 2 + quantum / 4)


def test_an_unconnected_velocity_is_at_rest(twin: TwinStation) -> None:
    ends = []
    for velocity in (None, np.zeros(6)):
        simulator = Simulator(twin)
        context = simulator.get_mutable_context()
        target = np.array([1e-3, 0, 0, 0, 0, 0])
        twin.GetInputPort("bolt.position").FixValue(context, target)
        if velocity is not None:
            twin.GetInputPort("bolt.velocity").FixValue(context, velocity)
        simulator.AdvanceTo(0.02)
        ends.append(numbers(context))
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize(("name", "port", "remedy"), [
    ("cell", "gripper.position", "station.grip_command"),
    ("cell", "iiwa.position", "station.start"),
    ("twin", "bolt.position", "station.start"),
])  # fmt: skip
def test_a_diagram_that_lacks_a_command_is_refused(name, port, remedy, request):
    station = request.getfixturevalue(name)
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    for command in ({"gripper.position", f"{station.arm}.position"}) - {port}:
        if station.HasInputPort(command):
            size = station.GetInputPort(command).size()
            station.GetInputPort(command).FixValue(context, np.zeros(size))
    with refused(f"{port} is not connected", remedy):
        simulator.Initialize()


def test_a_reconfigured_twin_begins_as_a_new_one() -> None:
    """Its default Context is the old scenario's; `begin` goes by the new one."""
    other = load_scenario("removal_turned", [QUIET, "part.clearance=3e-4"])
    other.gripper.stiffness = [2.0 * k for k in other.gripper.stiffness]
    reused, fresh = TwinStation(load_scenario("removal", [QUIET])), TwinStation(other)
    context = reused.CreateDefaultContext()
    reused.reconfigure(context, other)
    begun = reused.begin(context)
    np.testing.assert_array_equal(begun.reading, fresh.initial_state.reading)
    X_GnG = fresh.true_groove_pose(fresh.CreateDefaultContext())
    assert reused.true_groove_pose(context).IsExactlyEqualTo(X_GnG)
