"""The cell's own outputs at rest, against statics."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.tree import JacobianWrtVariable

from drake_disasm.common.ports import Health
from drake_disasm.effects import GroovePose
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import CellStation
from tests.drake_disasm.conftest import QUIET


@pytest.fixture(scope="module", params=["friction", "weld"])
def held(request: pytest.FixtureRequest) -> CellStation:
    return CellStation(
        load_scenario("removal", [QUIET, f"gripper.hold={request.param}"])
    )


def _rest(station: CellStation, *ports: str) -> list[np.ndarray]:
    context = station.settled([])
    return [station.GetOutputPort(port).Eval(context) for port in ports]


def test_arm_and_tool_rest_where_they_are_commanded(held):
    """Nothing touches the tool, and the bolt is part of it, however it is held."""
    ports = ("position_commanded", "position_measured", "torque_external")
    commanded, measured, external = _rest(held, *(f"iiwa.{port}" for port in ports))
    np.testing.assert_array_equal(commanded, held.start)
    np.testing.assert_allclose(measured, held.start, atol=1e-6)
    np.testing.assert_allclose(external, 0.0, atol=0.05)
    for device in ("iiwa", "gripper", "ft_sensor"):
        health, time = _rest(held, f"{device}.health", f"{device}.time_measured")
        assert health[0] == Health.READY
        assert time[0] == pytest.approx(held.settling_time)


def test_measured_torque_carries_the_weight(held: CellStation) -> None:
    """At rest: minus the gravity torque of arm, tool and bolt."""
    plant, context = held.plant, held.settled([])
    plant_context = held.part_context(plant, context)
    gravity = plant.CalcGravityGeneralizedForces(plant_context)
    expected = -plant.GetVelocitiesFromArray(held.arm_instance, gravity)
    if held.scenario.gripper.hold == "friction":  # there the bolt is a body apart
        p_WG, world = held.X_WG.translation(), plant.world_frame()
        flange = plant.GetFrameByName("iiwa_link_ee")
        p_F = flange.CalcPoseInWorld(plant_context).inverse() @ p_WG
        J_W = plant.CalcJacobianTranslationalVelocity(
            plant_context, JacobianWrtVariable.kV, flange, p_F, world, world
        )
        weight = J_W.T @ [0.0, 0.0, 0.2 * 9.81]
        expected = expected + plant.GetVelocitiesFromArray(held.arm_instance, weight)
    measured = held.GetOutputPort("iiwa.torque_measured").Eval(context)
    np.testing.assert_allclose(measured, expected, atol=5e-3)


@pytest.mark.parametrize("force", [30.0, 90.0])
def test_pads_press_with_the_grip_force(force: float) -> None:
    scenario: Scenario = load_scenario(
        "removal", [QUIET, f"gripper.grip_force={force}"]
    )
    station = CellStation(scenario)
    context = station.settled([])
    state = station.GetOutputPort("gripper.state_measured").Eval(context)
    np.testing.assert_allclose(state, [0.012, 0.0], atol=1e-4)  # the grip's width
    contacts = station.GetOutputPort("contact_results").Eval(context)
    across = [
        abs(contacts.hydroelastic_contact_info(i).F_Ac_W().translational()[1])
        for i in range(contacts.num_hydroelastic_contacts())
    ]
    assert len(across) == 2
    np.testing.assert_allclose(across, force, rtol=0.02)


def test_a_bolt_in_a_groove_that_sinks_into_the_bench_meets_the_groove_alone() -> None:
    station = CellStation(load_scenario("removal", [QUIET]))
    context = station.settled([GroovePose(rz=-0.1)])  # 4 mm deeper at 40 mm
    plant = station.plant
    own = station.part_context(plant, context)
    X_WG = plant.EvalBodyPoseInWorld(own, station.lock.groove)
    X_GB = RigidTransform([0.04, 0.0, 0.0])
    plant.SetFreeBodyPose(own, station.lock.bolt, X_WG @ X_GB)
    inspector = station.GetOutputPort("query_object").Eval(context).inspector()
    contacts = station.GetOutputPort("contact_results").Eval(context)
    met = set()
    for i in range(contacts.num_hydroelastic_contacts()):
        surface = contacts.hydroelastic_contact_info(i).contact_surface()
        met |= {inspector.GetName(surface.id_M()), inspector.GetName(surface.id_N())}
    assert "bench::plate_collision" not in met
    [bench] = plant.GetCollisionGeometriesForBody(plant.GetBodyByName("bench"))
    parts = plant.GetCollisionGeometriesForBody(station.lock.bolt)
    inside = set(station.lock.bolt_ids.values())
    for part in parts:  # a bolt that is dropped beside the lock lies on its grip
        assert inspector.CollisionFiltered(part, bench) == (part in inside)
