"""The processor as a system, and the small-angle form in closed form."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.common.rotations import Pose
from drake_disasm.common.spatial import (
    pose_to_vector,
    rotation_vector,
    shift_and_express,
    weight_wrench,
)
from drake_disasm.systems.observation import (
    Mounting,
    ObservationProcessor,
    small_angle_contact_wrench,
)

G_W = np.array([0.0, 0.0, -9.81])
R_WG = RollPitchYaw(np.pi / 2, 0.0, -0.7).ToRotationMatrix()
R_SB = RotationMatrix(np.array([[-1.0, 0, 0], [0, 0, -1.0], [0, -1.0, 0]]))
G, L1, L2 = 10.06, 0.07, 0.26
UPRIGHT = Mounting(
    RigidTransform(R_SB, [0, 0, L2]), R_WG, G / 9.81, np.array([0, 0, L1]), G_W
)
X_ASKEW = RigidTransform(RollPitchYaw(0.4, -0.3, 2.0), [0.1, -0.2, 0.3])
ASKEW = Mounting(X_ASKEW, R_WG, 1.7, np.array([0.02, -0.05, 0.1]), G_W)


def _weight(mounting: Mounting, R_GB: RotationMatrix) -> np.ndarray:
    R_WS = mounting.R_WG @ R_GB @ mounting.X_SB.rotation().inverse()
    return weight_wrench(mounting.mass, mounting.p_SoScm_S, R_WS.matrix(), G_W)


def _observe(variant, mounting, coordinates, reading, at_zeroing):
    """Returns observation and pose of a processor that has been zeroed."""
    processor = ObservationProcessor(BoltCoordinates(), mounting, variant)
    context = processor.CreateDefaultContext()
    processor.zero(context, at_zeroing)
    processor.GetInputPort("position_measured").FixValue(context, coordinates)
    processor.GetInputPort("wrench").FixValue(context, reading)
    ports = map(processor.GetOutputPort, ("observation", "X_GB"))
    return [port.Eval(context) for port in ports]


@pytest.mark.parametrize("seed", range(3))
def test_recovers_contact_through_offset_and_weight(seed: int) -> None:
    """The offset is whatever the reading at the start had beside the weight."""
    generator = np.random.default_rng(seed)
    q = np.concatenate([generator.normal(size=3), generator.uniform(-1.2, 1.2, 3)])
    X_GB = BoltCoordinates().pose(q)
    wrench, offset = generator.normal(size=(2, 6))
    X_SG = (RigidTransform(X_GB.rotation()) @ ASKEW.X_SB.inverse()).inverse()
    contact_S = shift_and_express(wrench, X_SG)
    reading = contact_S + _weight(ASKEW, X_GB.rotation()) + offset
    at_zeroing = _weight(ASKEW, RotationMatrix()) + offset
    observation, pose = _observe("exact", ASKEW, q, reading, at_zeroing)
    np.testing.assert_allclose(observation[6:], wrench, atol=1e-12)
    np.testing.assert_array_equal(observation[:3], q[:3])
    expected = rotation_vector(X_GB.rotation())
    np.testing.assert_allclose(observation[3:6], expected, atol=1e-15)
    np.testing.assert_allclose(pose, pose_to_vector(X_GB), atol=1e-15)


def test_reads_nothing_where_it_was_zeroed_and_roll_pitch_yaw() -> None:
    offset = np.array([1, 2, 3, 0.1, 0.2, 0.3])
    reading = _weight(UPRIGHT, RotationMatrix()) + offset
    for variant in ("exact", "small_angle"):
        observation, _ = _observe(variant, UPRIGHT, np.zeros(6), reading, reading)
        np.testing.assert_allclose(observation, 0.0, atol=1e-13)
    R = RollPitchYaw(0.1, -0.2, 0.3).ToRotationMatrix()
    q = BoltCoordinates().solve(RigidTransform(R), np.zeros(6))
    observation, _ = _observe("small_angle", UPRIGHT, q, np.zeros(6), np.zeros(6))
    np.testing.assert_allclose(observation[3:6], [0.1, -0.2, 0.3], atol=1e-14)


def _error(alpha: float, gamma: float, wrench: np.ndarray | None = None) -> np.ndarray:
    """The thesis's form minus the truth: in free air, or under a wrench in G."""
    wrench = np.zeros(6) if wrench is None else wrench
    R_GB = RollPitchYaw(alpha, 0.0, gamma).ToRotationMatrix()
    X_GS = RigidTransform(R_GB) @ UPRIGHT.X_SB.inverse()
    contact_S = shift_and_express(wrench, X_GS.inverse())
    tare, reading = _weight(UPRIGHT, RotationMatrix()), _weight(UPRIGHT, R_GB)
    X_GB = Pose.of(RigidTransform(R_GB))
    return small_angle_contact_wrench(reading + contact_S, tare, X_GB, UPRIGHT) - wrench


def test_small_angle_form_does_not_turn_the_wrench_back() -> None:
    """With contact it is exact upright, and its error is of first order beyond."""
    wrench, angle = np.array([1.0, 5.0, 0.5, 0.1, 0.2, -0.3]), np.deg2rad(2.0)
    np.testing.assert_allclose(_error(0.0, 0.0, wrench), 0.0, atol=1e-12)
    error = _error(angle, angle, wrench)
    assert 0.5 * 5.0 * angle < np.abs(error[:3]).max() < 3.0 * 5.0 * angle


@pytest.mark.parametrize(
    ("a_deg", "c_deg"),
    [(1.0, 5.0), (30.0, 30.0), (-30.0, 5.0), (30.0, 0.0), (0.0, 30.0)],
)
def test_small_angle_form_departs_in_closed_form(a_deg: float, c_deg: float) -> None:
    """Gravity in B is G [-sin c, 1 - cos c cos a, cos c sin a] after zeroing; eq. 4.6
    has G [-sin c, 2 - cos a - cos c, sin a]: third order, 0.7 N at 30 degrees."""
    a, c = np.deg2rad(a_deg), np.deg2rad(c_deg)
    found = _error(a, c)
    fy = -G * (1 - np.cos(a)) * (1 - np.cos(c))
    fz = -G * np.sin(a) * (1 - np.cos(c))
    np.testing.assert_allclose(found[:3], [0, fy, fz], atol=1e-12)
    # Torque: the lever l1 of gravity, and the shift to the bolt, act on fz alone.
    assert found[3] == pytest.approx(fz * (L2 - L1), abs=1e-12)
    np.testing.assert_allclose(found[4:], 0.0, atol=1e-12)
    bound = G * max(abs(a), abs(c)) ** 3 / 2
    assert np.abs(found[:3]).max() <= bound
