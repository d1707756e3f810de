"""Effects that depend on the bolt's motion, in a user's own diagram."""

from collections.abc import Sequence

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus
from pydrake.systems.primitives import Demultiplexer, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_disasm.effects import (
    Backlash,
    Effect,
    GrooveBend,
    GrooveViscousFriction,
    RustyPatch,
)
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import TwinStation
from tests.drake_disasm.conftest import QUIET, STIFF
from tests.refusals import refused

SPEED, DURATION = 0.01, 2.4  # m/s along the groove, s
PRESSED = 0.6e-3  # m, the command across the slot: 5.3 N on the lip
PATCH = RustyPatch(coefficient=0.3, position=0.015, width=0.003)
EXACT = [QUIET, STIFF, "ft_sensor.quantum=[0,0,0,0,0,0]"]


class Pull:
    """The twin in a diagram of its own, pulled along the groove at constant speed."""

    def __init__(
        self,
        effects: Sequence[Effect],
        across: float = PRESSED,
        has_velocity: bool = True,
        model: str = "impact",
    ) -> None:
        scenario = load_scenario("removal", [*EXACT, f"contact.model={model}"])
        scenario.effects = list(effects)
        builder = DiagramBuilder()
        self.station = builder.AddSystem(TwinStation(scenario))
        ends = [[0, 0, across, 0, 0, 0], [SPEED * DURATION, 0, across, 0, 0, 0]]
        path = PiecewisePolynomial.FirstOrderHold([0.0, DURATION], np.transpose(ends))
        command = builder.AddSystem(TrajectorySource(path, 1))
        parts = builder.AddSystem(Demultiplexer([6, 6]))
        builder.Connect(command.get_output_port(), parts.get_input_port())
        for i, name in enumerate(["position", "velocity"][: 1 + has_velocity]):
            port = self.station.GetInputPort(f"bolt.{name}")
            builder.Connect(parts.get_output_port(i), port)
        self.simulator = Simulator(builder.Build())
        root = self.simulator.get_mutable_context()
        self.context = self.station.GetMyMutableContextFromRoot(root)

    def to(self, time: float) -> "Pull":
        self.station.attach(self.simulator)
        self.simulator.AdvanceTo(time)
        return self

    @property
    def bolt(self) -> np.ndarray:
        port = self.station.GetOutputPort("bolt_pose")
        return port.Eval(self.context).translation()

    @property
    def force(self) -> np.ndarray:
        wrench = self.station.GetOutputPort("ft_sensor.wrench").Eval(self.context)
        f_S = (wrench - self.station.initial_state.reading)[:3]
        return self.station.X_SB.rotation().inverse() @ f_S


@pytest.fixture(scope="module")
def pulled() -> np.ndarray:
    pull, rows = Pull([PATCH]), []
    pull.station.attach(pull.simulator)
    known = 2 * pull.station.time_step  # the command has been seen to move
    for k in range(int(DURATION / 0.1)):
        pull.simulator.AdvanceTo(0.1 * k + known)
        at_update = pull.bolt[0]
        pull.simulator.AdvanceTo(0.1 * (k + 1))
        rows.append([at_update, pull.bolt[0], *pull.force])
    return np.array(rows[5:])


def test_a_patch_rubs_where_it_is(pulled: np.ndarray) -> None:
    """Coulomb's ratio is the configured coefficient at the place of the update.

    To a step of the plant, by which rounding may move the update: 0.05 mm, 0.004.
    """
    x, _, fx, _, fz = pulled.T
    expected = 0.2 + 0.3 * np.exp(-(((x - 0.015) / 0.003) ** 2))
    np.testing.assert_allclose(fx / fz, expected, atol=0.005)
    assert (expected > 0.49).any() and (expected < 0.201).sum() >= 2


def test_hydroelastic_materials_follow_too() -> None:
    """The scene graph's properties are changed while the simulation runs."""
    ratios = []
    for effects in ([RustyPatch(coefficient=0.3, position=0.005, width=0.05)], []):
        pull = Pull(effects, model="hydroelastic").to(0.45)
        ratios.append(pull.force[0] / pull.force[2])
    assert ratios[1] == pytest.approx(0.2, rel=0.01)
    assert ratios[0] == pytest.approx(0.5, rel=0.01)  # in the middle of the patch


@pytest.mark.parametrize("has_velocity", [True, False])
def test_the_commanded_velocity_is_seen(has_velocity: bool) -> None:
    """A drag of c v, in free motion, whether the rate is commanded too or not."""
    effects = ([GrooveViscousFriction(400.0)], [])
    drag, free = (
        Pull(each, across=0.0, has_velocity=has_velocity).to(0.3).force[0]
        for each in effects
    )
    assert drag - free == pytest.approx(-400.0 * SPEED, rel=1e-3)


def test_a_bend_turns_the_groove_under_the_bolt() -> None:
    pull = Pull([GrooveBend(kz=0.5)], across=0.0).to(1.05)
    X_GnG = pull.station.true_groove_pose(pull.context)
    assert X_GnG.rotation().matrix()[2, 0] == pytest.approx(0.5 * 0.01, rel=0.05)


def test_time_that_is_set_back_begins_anew() -> None:
    pull = Pull([PATCH])
    pull.station.attach(pull.simulator)
    runs = []
    for _ in range(2):
        root = pull.simulator.get_mutable_context()
        root.SetTime(0.0)
        pull.simulator.get_system().SetDefaultContext(root)
        pull.simulator.Initialize()
        pull.simulator.AdvanceTo(0.35)
        runs.append(pull.force)
    np.testing.assert_array_equal(*runs)


def test_without_attach_a_simulation_refuses_to_begin():
    pull = Pull([PATCH])
    with refused("RustyPatch", "station.attach(simulator)"):
        pull.simulator.Initialize()
    pull.station.attach(pull.simulator)
    pull.simulator.Initialize()
    with refused("RustyPatch", "station.attach"):  # another one of the same diagram
        Simulator(pull.simulator.get_system()).Initialize()
    pull = Pull([])
    pull.simulator.Initialize()
    pull.station.set_effects(pull.context, [GrooveBend(kz=0.5)])
    with refused("GrooveBend"):
        pull.simulator.Initialize()
    with refused("Backlash", "add_task(builder, station)"):
        Pull([Backlash(x=1e-4)]).simulator.Initialize()


def test_the_monitor_that_was_there_is_called_too() -> None:
    pull, times = Pull([PATCH]), []

    def monitor(root: Context) -> EventStatus | None:
        times.append(root.get_time())
        enough = root.get_time() > 0.05
        system = pull.simulator.get_system()
        return EventStatus.ReachedTermination(system, "enough") if enough else None

    pull.simulator.set_monitor(monitor)
    pull.station.attach(pull.simulator)
    pull.simulator.AdvanceTo(0.2)
    assert len(times) > 10
    assert pull.simulator.get_context().get_time() < 0.06
