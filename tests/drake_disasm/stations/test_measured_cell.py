"""The geometry of a measured cell: where the plant's own kinematics have it."""

import numpy as np
import pytest
from fault_runs import in_lockstep
from pydrake.geometry import Meshcat, QueryObject
from pydrake.math import RigidTransform

from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.policies import make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations.measured_cell import MeasuredCell
from drake_disasm.visualization import MeasuredView, MeshcatView, start_meshcat

_ARM = "/drake/visualizer/iiwa14/iiwa_link_7"


@pytest.fixture
def meshcat() -> Meshcat:
    return start_meshcat()


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load_scenario("removal")


def _poses(
    scenario: Scenario, q: np.ndarray, opening: float
) -> dict[str, RigidTransform]:
    """Returns where frames with geometry are in the world, by the body's name."""
    cell = MeasuredCell(scenario)
    context = cell.CreateDefaultContext()
    cell.GetInputPort("iiwa.position_measured").FixValue(context, q)
    cell.GetInputPort("gripper.state_measured").FixValue(context, [opening, 0.0])
    query: QueryObject = cell.GetOutputPort("query_object").Eval(context)
    inspector = query.inspector()
    return {
        inspector.GetName(frame).rpartition("::")[2]: query.GetPoseInWorld(frame)
        for frame in inspector.GetAllFrameIds()
    }


def test_bolt_and_fingers_are_where_the_arm_holds_them(scenario: Scenario) -> None:
    X_WG = nominal_groove_pose(scenario.placement)
    X_FB = Tool.from_models(scenario).X_FB
    arm = ArmCoordinates(scenario.arm, X_WG, X_FB, scenario.task.period)
    q = arm.start(RigidTransform()) + 0.05 * np.arange(7)
    X_WB = X_WG @ arm.pose(q)
    assert _poses(scenario, q, 0.04)["bolt"].IsNearlyEqualTo(X_WB, 1e-9)
    apart = []
    for opening in (0.06, 0.02):
        at = _poses(scenario, q, opening)
        a, b = (X.translation() for n, X in at.items() if n.endswith("_finger"))
        apart.append(np.linalg.norm(a - b))
    assert apart[0] - apart[1] == pytest.approx(0.04)


def test_a_run_on_hardware_is_seen_and_what_a_view_takes_is_counted(
    scenario, meshcat, monkeypatch
):
    """Whatever draws between the first and the last of the view's systems."""
    view = MeshcatView(meshcat)
    with in_lockstep(scenario, make_policy("straight"), views=[view]) as parts:
        simulation, station, cell = parts
        simulation.reset(0)
        view.begin_episode()
        begun = meshcat._GetPackedTransform(_ARM)
        for _ in range(3):
            simulation.step()
        assert meshcat._GetPackedTransform(_ARM) != begun
        assert meshcat.HasPath("path")
        assert not meshcat.HasPath("/drake/contact_forces")
        monkeypatch.setattr(view.wrench, "_draw", lambda *_: cell.skip(1))
        watches = station.gate.lag.stopwatches
        before = {name: watch.total for name, watch in watches.items()}
        simulation.step()
        took = {name: watch.total - before[name] for name, watch in watches.items()}
    assert set(took) == {"view", "policy", "inverse kinematics", "sending"}
    assert took["view"] > 0.02  # two arrows of 5 ms, in three frames
    assert took["policy"] == took["inverse kinematics"] == took["sending"] == 0.0


def test_a_view_follows_what_is_measured(scenario: Scenario, meshcat: Meshcat) -> None:
    with in_lockstep(scenario, make_policy("straight")) as (simulation, station, _):
        simulation.reset(0)
        view = MeasuredView(meshcat, station)
        unknown = {"iiwa.position_measured": np.full(7, np.nan)}
        view.show(station.measured() | unknown)  # can't be drawn, and is left out
        assert not meshcat._GetPackedTransform(_ARM)
        view.show(station.measured())
        assert meshcat._GetPackedTransform(_ARM)
