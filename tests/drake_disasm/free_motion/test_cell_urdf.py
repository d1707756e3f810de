"""The URDF of arm and tool: the same rigid bodies as the controller's own."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from drake_disasm.cell.arm_dynamics import ArmDynamics
from drake_disasm.cell.arm_model import add_arm
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.scenario import ArmConfig, load_scenario

SCENARIO = load_scenario("removal")


@pytest.fixture
def urdf(tmp_path: Path) -> str:
    path = tmp_path / "arm.urdf"
    path.write_text(cell_urdf(SCENARIO))
    return str(path)


def test_inertia_and_gravity_are_those_of_arm_and_tool(urdf: str) -> None:
    plant = MultibodyPlant(0.0)
    add_arm(plant, ArmConfig(model=urdf))
    plant.Finalize()
    X_WG = nominal_groove_pose(SCENARIO.placement)
    known = ArmDynamics(SCENARIO.arm, Tool.from_models(SCENARIO), X_WG)
    own, its = plant.CreateDefaultContext(), known.plant.CreateDefaultContext()
    for q in np.random.default_rng(0).uniform(-1.5, 1.5, (3, 7)):
        plant.SetPositions(own, q)
        known.plant.SetPositions(its, q)
        known.set_positions(q)
        np.testing.assert_allclose(
            plant.CalcMassMatrix(own), known.mass_matrix(), rtol=1e-9, atol=1e-12
        )
        np.testing.assert_allclose(
            plant.CalcGravityGeneralizedForces(own),
            known.plant.CalcGravityGeneralizedForces(its),
            atol=1e-9,
        )


def test_tool_and_bench_are_there_to_be_run_into(urdf: str) -> None:
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    add_arm(plant, ArmConfig(model=urdf))
    plant.Finalize()
    for name in ("tool", "bench", "iiwa_link_6"):
        assert plant.GetCollisionGeometriesForBody(plant.GetBodyByName(name))
