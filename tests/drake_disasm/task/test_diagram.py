"""The task in a diagram of one's own: the same numbers as a TaskSimulation's."""

from collections.abc import Iterator

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    System,
)
from pydrake.systems.primitives import ConstantVectorSource

from drake_disasm.common.timing import boundary
from drake_disasm.effects import GroovePose
from drake_disasm.policies import make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import make_station
from drake_disasm.systems.policy import Policy
from drake_disasm.task.diagram import TaskSystems, add_task
from drake_disasm.task.simulation import TaskSimulation
from tests.refusals import refused

QUIET = "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"
#: Effects of every kind that the twin carries, and a motion effect in the default.
EFFECTS = (
    "effects=[!GroovePose {ry: 0.02}, !SensorBias {fx: 0.5}, !CommandGain {x: 0.02}]"
)
STEPS = 12


class AsSystem(LeafSystem):
    """A policy as a user would write it: no state, one input, one output."""

    def __init__(self, policy: Policy) -> None:
        super().__init__()
        self._policy = policy
        self.DeclareVectorInputPort("observation", 12)
        self.DeclareVectorOutputPort("action", 6, self._calc_action)

    def _calc_action(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._policy(self.get_input_port().Eval(context)))


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load_scenario("removal", [QUIET, EFFECTS])


def _own_diagram(
    scenario: Scenario, station: str, policy: Policy | System | None
) -> tuple[Diagram, TaskSystems]:
    """Returns a diagram as a user builds it, without a TaskSimulation."""
    builder = DiagramBuilder()
    added = builder.AddNamedSystem("station", make_station(station, scenario))
    systems = add_task(builder, added, policy)
    return builder.Build(), systems


def _observations(diagram: Diagram, systems: TaskSystems) -> np.ndarray:
    """Returns the observation after each period, from the default Context."""
    simulator = Simulator(diagram)
    context = systems.processor.GetMyContextFromRoot(simulator.get_context())
    port, seen = systems.processor.GetOutputPort("observation"), []
    for step in range(STEPS):
        simulator.AdvanceTo(boundary(step, systems.station.scenario.task.period))
        seen.append(port.Eval(context))
    return np.array(seen)


@pytest.fixture(scope="module")
def stepped(scenario: Scenario) -> np.ndarray:
    simulation = TaskSimulation(scenario, "twin", make_policy("admittance"))
    first = simulation.reset(seed=7)
    rest = [simulation.step().observation for _ in range(STEPS - 1)]
    return np.array([first, *rest])


def test_own_diagram_gives_the_same_observations(scenario, stepped):
    """Whether the policy is a callable or a system."""
    policy = make_policy("admittance")
    for each in (policy, AsSystem(policy)):
        found = _observations(*_own_diagram(scenario, "twin", each))
        np.testing.assert_array_equal(found, stepped)
    assert stepped[-1, 0] > 5e-3 and np.abs(stepped[-1, 6:]).max() > 0.1


def _states(
    system: System, context: Context, path: str = ""
) -> Iterator[tuple[str, np.ndarray]]:
    """Yields every number that a Context holds, by the path of its system."""
    if isinstance(system, Diagram):
        for part in system.GetSystems():
            inner = system.GetSubsystemContext(part, context)
            name = part.get_name().partition("@")[0]  # Drake's own ends in an address
            yield from _states(part, inner, f"{path}/{name}")
        return
    for i in range(context.num_discrete_state_groups()):
        yield f"{path} state {i}", context.get_discrete_state(i).CopyToVector()
    for i in range(context.num_numeric_parameter_groups()):
        yield f"{path} parameter {i}", context.get_numeric_parameter(i).CopyToVector()


@pytest.mark.parametrize("station", ["twin", "cell"])
def test_the_default_context_is_where_an_episode_starts(station: str) -> None:
    """Every state and parameter, after an episode with other effects, too."""
    scenario = load_scenario("removal", ["imprecision=1e-4", EFFECTS])
    simulation = TaskSimulation(scenario, station)
    simulation.reset(5, [GroovePose(ry=-0.02)])
    simulation.reset(5)
    expected = dict(_states(simulation.diagram, simulation.context))
    diagram, systems = _own_diagram(scenario, station, None)
    simulator = Simulator(diagram)
    systems.set_seed(simulator.get_mutable_context(), 5)
    simulator.Initialize()
    simulator.AdvanceTo(boundary(0, scenario.task.period))
    found = dict(_states(diagram, simulator.get_context()))
    assert found.keys() == expected.keys() and len(found) > 20
    for name, value in found.items():
        np.testing.assert_array_equal(value, expected[name], err_msg=name)


def test_other_effects_and_seeds_are_put_into_a_context(scenario: Scenario) -> None:
    noisy = load_scenario("removal", ["imprecision=1e-4"])
    diagram, systems = _own_diagram(noisy, "twin", make_policy("admittance"))
    simulation = TaskSimulation(noisy, "twin", make_policy("admittance"))
    turned = [GroovePose(ry=0.03)]
    expected = [simulation.reset(3, turned), simulation.step().observation]
    simulator = Simulator(diagram)
    root = simulator.get_mutable_context()
    systems.begin(root, turned)
    systems.set_seed(root, 3)
    simulator.Initialize()
    context = systems.processor.GetMyContextFromRoot(root)
    for step, wanted in enumerate(expected):
        simulator.AdvanceTo(boundary(step, noisy.task.period))
        seen = systems.processor.GetOutputPort("observation").Eval(context)
        np.testing.assert_array_equal(seen, wanted)


def test_a_system_that_is_no_policy_or_elsewhere_is_refused(scenario):
    _, systems = _own_diagram(scenario, "twin", None)
    assert systems.policy is None and systems.action_source is not None
    assert systems.action_port.get_system() is systems.action_source
    with refused("no input port 'observation' of size 12"):
        _own_diagram(scenario, "twin", ConstantVectorSource(np.zeros(6)))
    bad = AsSystem(lambda s: np.full(6, np.nan))
    with refused("an action must be finite"):
        Simulator(_own_diagram(scenario, "twin", bad)[0]).AdvanceTo(0.01)
    clearance = "randomisation=[{parameter: part.clearance, low: 3e-4, high: 5e-4}]"
    wide = load_scenario("removal", [clearance])  # needs a diagram anew
    with refused("can't move to another diagram"):
        TaskSimulation(wide, "twin", AsSystem(make_policy("straight"))).reset(0)
