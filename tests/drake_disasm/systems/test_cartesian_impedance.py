"""Cartesian impedance control: torques of a spring and damper at the bolt."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_disasm.cell.arm_control import cartesian_gains
from drake_disasm.cell.arm_dynamics import ArmDynamics
from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.stations import CellStation
from drake_disasm.systems.cartesian_impedance import CartesianImpedance


@pytest.fixture(scope="module")
def dynamics(cell: CellStation) -> ArmDynamics:
    """Of the default cell."""
    return ArmDynamics(cell.scenario.arm, cell.tool, cell.X_WG)


@pytest.fixture(scope="module")
def control(cell: CellStation) -> CartesianImpedance:
    """With KUKA's gains."""
    own = ArmDynamics(cell.scenario.arm, cell.tool, cell.X_WG)
    return CartesianImpedance(cell.scenario.arm, own, cell.start)


def _torque(
    control: CartesianImpedance, state: np.ndarray, desired: np.ndarray
) -> np.ndarray:
    context = control.CreateDefaultContext()
    control.GetInputPort("state").FixValue(context, state)
    control.GetInputPort("desired_state").FixValue(context, desired)
    return np.asarray(control.get_output_port().Eval(context))


def _at_rest(q: np.ndarray) -> np.ndarray:
    return np.concatenate([q, np.zeros(7)])


def test_displaced_bolt_is_drawn_back_by_its_stiffness(control, dynamics, cell):
    """Statics: the torques hold the load K e on the bolt, and none besides."""
    K = np.array(cell.scenario.arm.cartesian_impedance.stiffness)
    for e in 1e-3 * np.eye(6):
        X_GB = RigidTransform(rotation_from_vector(-e[3:]), -e[:3])
        q = cell.coordinates.solve(X_GB, cell.start)
        torque = _torque(control, _at_rest(q), _at_rest(cell.start))
        dynamics.set_positions(q)
        J, M = dynamics.jacobian(), dynamics.mass_matrix()
        felt = dynamics.bolt_inertia() @ J @ np.linalg.solve(M, torque)
        np.testing.assert_allclose(felt, K * e, rtol=1e-3, atol=2e-3)


def test_moving_bolt_is_braked_by_its_damping(control, dynamics, cell):
    rest = _at_rest(cell.start)
    np.testing.assert_allclose(_torque(control, rest, rest), 0.0, atol=1e-9)
    v = np.array([0.1, -0.2, 0.1, 0.3, 0.0, -0.1, 0.2])
    state = np.concatenate([cell.start, v])
    torque = _torque(control, state, rest)
    dynamics.set_positions(cell.start)
    J, M = dynamics.jacobian(), dynamics.mass_matrix()
    felt = dynamics.bolt_inertia() @ J @ np.linalg.solve(M, torque)
    _, D = cartesian_gains(cell.scenario.arm, dynamics.bolt_inertia())
    np.testing.assert_allclose(felt, -D @ J @ v, rtol=1e-9)


def test_elbow_is_drawn_back_without_moving_the_bolt(control, dynamics, cell):
    dynamics.set_positions(cell.start)
    J, M = dynamics.jacobian(), dynamics.mass_matrix()
    elbow = 0.01 * np.linalg.svd(J)[2][-1]  # J elbow = 0
    state = np.concatenate([cell.start, elbow])
    torque = _torque(control, state, _at_rest(cell.start))
    acceleration = np.linalg.solve(M, torque)
    np.testing.assert_allclose(J @ acceleration, 0.0, atol=1e-9)
    assert acceleration @ elbow < 0.0
