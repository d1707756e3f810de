"""From sensor readings to the state that the agent sees (thesis 4.2.4)."""

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_disasm.cell.coordinates import Coordinates
from drake_disasm.common.arrays import Array, apply_matrix, namespace
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.rotations import (
    Pose,
    as_matrices,
    rotation_vectors,
    rpy_of_matrices,
)
from drake_disasm.common.spatial import (
    pose_to_vector,
    rotation_from_vector,
    rotation_vector,
    shifted_wrench,
)
from drake_disasm.common.timing import MOTION_DELAY
from drake_disasm.devices.sensor_chain import Payload
from drake_disasm.effects import LONGEST_POSE_MEMORY, Effect, pose_weights


@dataclasses.dataclass(frozen=True)
class Mounting:
    """How the sensor is mounted between bolt and robot, and its payload.

    Attributes:
        X_SB: the bolt in the sensor frame, as grasped.
        R_WG: the groove's nominal frame in the world.
        mass, p_SoScm_S: payload of the sensor [kg], (3,) [m].
        g_W: gravity (3,) [m/s^2].
        X_GS: the sensor where it stands under the fixed part; None: it moves with the
            bolt.

    Of n sensors poses and rotations are arrays, mass is (n, 1), vectors are (n, 3).
    """

    X_SB: RigidTransform | Pose
    R_WG: RotationMatrix | Array
    mass: float | Array
    p_SoScm_S: Array
    g_W: Array
    X_GS: RigidTransform | Pose | None = None

    @functools.cached_property
    def X_BS(self) -> Pose:
        """The sensor in the bolt's frame."""
        return _as_pose(self.X_SB).inverse()

    def from_bolt(self, X_GB: Pose) -> Pose:
        """Returns the sensor's axes, and where it is from Bo: R_GS and p_BoSo_G."""
        if self.X_GS is None:
            X_BS, R = self.X_BS, X_GB.R
            return Pose(namespace(R).matmul(R, X_BS.R), apply_matrix(R, X_BS.p))
        X_GS, xp = _as_pose(self.X_GS), namespace(X_GB.R)
        return Pose(xp.broadcast_to(X_GS.R, X_GB.R.shape), X_GS.p - X_GB.p)

    @property
    def payload(self) -> Payload:
        """What the sensor is known to carry."""
        return Payload(self.mass, self.p_SoScm_S, self.g_W)

    @property
    def weight_at_start(self) -> Array:
        """The payload's load on the sensor (..., 6) as an episode begins, in S."""
        standing = self.X_BS if self.X_GS is None else self.X_GS
        return self.weight(standing.rotation())

    @property
    def sign(self) -> float:
        """Of the wrench on the bolt by the load: -1 where the fixed part has it."""
        return 1.0 if self.X_GS is None else -1.0

    def R_WS(self, R_GS: Array) -> Array:
        """Returns the sensor's orientation in the world (..., 3, 3)."""
        return namespace(R_GS).matmul(as_matrices(self.R_WG), R_GS)

    def weight(self, R_GS: RotationMatrix | Array) -> Array:
        """Returns the payload's load on the sensor, (..., 6) [f; tau] at So in S."""
        return self.payload.weight(self.R_WS(as_matrices(R_GS)))


def _as_pose(X: RigidTransform | Pose) -> Pose:
    return X if isinstance(X, Pose) else Pose.of(X)


def contact_wrench(
    reading: Array, offset: Array, X_GB: Pose, mounting: Mounting
) -> Array:
    """Returns the environment's wrench on the bolt at Bo in G, exactly.

    Takes off the zeroing offset and the payload's weight at this orientation,
    then shifts from So to Bo and expresses in G (eq. 4.4, 4.6, 4.7 without
    their small-angle and on-axis assumptions).

    Args:
        reading: (..., 6) raw [f; tau] at So in S.
        offset: (..., 6) the reading at zeroing less the payload's weight.
        X_GB: measured pose of the bolt.
        mounting: geometry and payload.
    """
    there = mounting.from_bolt(X_GB)
    load = reading - offset - mounting.weight(there.R)
    return shifted_wrench(mounting.sign * load, there.R, there.p)


def small_angle_contact_wrench(
    reading: Array, tare: Array, X_GB: Pose, mounting: Mounting
) -> Array:
    """Returns the same by the thesis's equations 4.4, 4.6 and 4.7.

    They hold for a sensor whose axis (their y) is upright when zeroed, a payload
    on that axis, and small rotations. alpha and gamma are the rotations about x
    and z. Two signs differ from the print: our reading is the load on the sensor,
    so the change by gravity is subtracted; and tau_z is -G sin(gamma) l1, which is
    what eq. 4.7's own geometry (p x f on the y axis) gives, where 4.6 prints +.

    Args:
        reading, X_GB, mounting: as in `contact_wrench`.
        tare: (..., 6) the reading at zeroing.
    """
    xp, X_BS = namespace(reading), mounting.X_BS
    change = reading - tare
    f, t = (apply_matrix(X_BS.R, part) for part in (change[..., :3], change[..., 3:]))
    rpy = rpy_of_matrices(X_GB.R)
    alpha, gamma = rpy[..., 0:1], rpy[..., 2:3]
    G = mounting.mass * _length(mounting.g_W)
    l1, l2 = _length(mounting.p_SoScm_S), _length(X_BS.p)
    rise = 2.0 - xp.cos(alpha) - xp.cos(gamma)
    f = f - G * xp.concat([-xp.sin(gamma), rise, xp.sin(alpha)], axis=-1)
    zero = xp.zeros_like(alpha)
    t = t + G * l1 * xp.concat([xp.sin(alpha), zero, xp.sin(gamma)], axis=-1)
    lever = xp.concat([f[..., 2:], zero, -f[..., :1]], axis=-1)
    return xp.concat([f, t + l2 * lever], axis=-1)


def _length(vectors: Array) -> Array:
    """Returns the length (..., 1) of vectors (..., 3)."""
    return namespace(vectors).sum(vectors * vectors, axis=-1, keepdims=True) ** 0.5


@dataclasses.dataclass(frozen=True)
class StateFromReadings:
    """From readings to the state, as a pure function (thesis 4.2.4).

    Attributes:
        mounting: geometry and payload of the sensor.
        is_exact: or by the thesis's equations, for small angles.
    """

    mounting: Mounting
    is_exact: bool = True

    def offset(self, reading: Array) -> Array:
        """Returns what zeroing takes off, of readings (..., 6) with X_GB = identity."""
        if not self.is_exact:
            return reading
        return reading - self.mounting.weight_at_start

    def state(self, X_GB: Pose, reading: Array, offset: Array) -> Array:
        """Returns states s (..., 12) of measured poses and raw readings (..., 6).

        Args:
            X_GB: measured.
            reading: [f; tau] at So in S.
            offset: (..., 6) from `offset`.
        """
        wrench = self.wrench(X_GB, reading, offset)
        to_vector = rotation_vectors if self.is_exact else rpy_of_matrices
        return namespace(wrench).concat([X_GB.p, to_vector(X_GB.R), wrench], axis=-1)

    def wrench(self, X_GB: Pose, reading: Array, offset: Array) -> Array:
        """Returns the wrench (..., 6) of readings; see `state`."""
        process = contact_wrench if self.is_exact else small_angle_contact_wrench
        return process(reading, offset, X_GB, self.mounting)


class ObservationProcessor(LeafSystem):
    """Puts out the state s = [x y z u v w Fx Fy Fz Tx Ty Tz] (thesis, eq. 4.1).

    Pose of the bolt relative to the start, from the measured coordinates, and
    the environment's wrench on it, both in the groove's nominal frame. The
    zeroing of the sensor is a parameter of the Context, set by `zero`. Effects on
    the measured pose act on both outputs; poses that they look back at are those at
    the boundaries of the MDP's steps.

    @system
    name: ObservationProcessor
    input_ports:
    - position_measured
    - wrench
    output_ports:
    - observation
    - X_GB
    @endsystem

    Args:
        coordinates: maps the measured coordinates to X_GB.
        mounting: geometry and payload of the sensor.
        variant: "exact", or "small_angle" for the thesis's equations.
        reading: (6,) at which the default Context is zeroed; None: it is not.
        period: of the MDP [s]; None: no effect can act on the measured pose.
        effects: of the default Context.

    Raises:
        DisasmError: effects look farther back than it remembers.
    """

    def __init__(
        self,
        coordinates: Coordinates,
        mounting: Mounting,
        variant: str = "exact",
        reading: np.ndarray | None = None,
        period: float | None = None,
        effects: Sequence[Effect] = (),
    ) -> None:
        super().__init__()
        self._remember_poses(period, effects)
        self._coordinates = coordinates
        self._processing = StateFromReadings(mounting, variant == "exact")
        offset = np.zeros(6) if reading is None else self._processing.offset(reading)
        self._offset = self.DeclareNumericParameter(BasicVector(offset))
        self._position = self.DeclareVectorInputPort(
            "position_measured", coordinates.size
        )
        self._wrench = self.DeclareVectorInputPort("wrench", 6)
        position = self._position.ticket()
        self.DeclareVectorOutputPort(
            "observation",
            12,
            self._calc_observation,
            prerequisites_of_calc={
                position,
                self._wrench.ticket(),
                self.xd_ticket(),
                self.all_parameters_ticket(),
            },
        )
        self.DeclareVectorOutputPort(
            "X_GB",
            7,
            self._calc_pose,
            prerequisites_of_calc={
                position,
                self.xd_ticket(),
                self.all_parameters_ticket(),
            },
        )

    def _remember_poses(self, period: float | None, effects: Sequence[Effect]) -> None:
        """Declares what effects on the measured pose need."""
        self._period = period
        # An episode begins at A, where position and rotation vector are zero.
        kept = int(np.ceil(LONGEST_POSE_MEMORY / period - 1e-9)) if period else 0
        self._before = self.DeclareDiscreteState(6 * kept)  # the newest first
        self._most = kept + 1
        self._weights = self.DeclareNumericParameter(
            BasicVector(self._weights_of(effects))
        )
        if period:
            self.DeclarePeriodicDiscreteUpdateEvent(
                period, MOTION_DELAY, self._remember
            )

    def set_effects(self, context: Context, effects: Sequence[Effect]) -> None:
        """Puts effects into this system's Context: those on the measured pose act.

        Raises:
            DisasmError: they look farther back than it remembers.
        """
        parameter = context.get_mutable_numeric_parameter(self._weights)
        parameter.SetFromVector(self._weights_of(effects))

    def _weights_of(self, effects: Sequence[Effect]) -> np.ndarray:
        found = pose_weights(effects, self._period) if self._period else np.ones(1)
        if len(found) > self._most:
            raise DisasmError(
                "effects: those on the measured pose look back by more than "
                f"{LONGEST_POSE_MEMORY:g} s together; make their delays shorter"
            )
        return np.pad(found, (0, self._most - len(found)))

    def _remember(self, context: Context, state: DiscreteValues) -> EventStatus:
        if not self._is_late(context):
            return EventStatus.DidNothing()
        before = context.get_discrete_state(self._before).value()
        state.set_value(self._before, [*self._pose_vector(context), *before[:-6]])
        return EventStatus.Succeeded()

    def _is_late(self, context: Context) -> bool:
        """Returns whether an earlier pose has a weight in the one that is reported."""
        weights = context.get_numeric_parameter(self._weights).value()
        return bool(weights[0] != 1.0)

    def _X_GB(self, context: Context) -> RigidTransform:
        """Returns the pose as it is reported."""
        if not self._is_late(context):
            return self._coordinates.pose(self._position.Eval(context))
        weights = context.get_numeric_parameter(self._weights).value()
        before = context.get_discrete_state(self._before).value().reshape(-1, 6)
        pose = weights @ np.vstack([self._pose_vector(context), before])
        return RigidTransform(rotation_from_vector(pose[3:]), pose[:3])

    def _pose_vector(self, context: Context) -> np.ndarray:
        """Returns position and rotation vector (6,) of where the bolt is now."""
        X_GB = self._coordinates.pose(self._position.Eval(context))
        return np.append(X_GB.translation(), rotation_vector(X_GB.rotation()))

    def zero(self, context: Context, reading: np.ndarray) -> None:
        """Zeroes the sensor: `reading` (6,) was taken at the start, X_GB = identity."""
        parameter = context.get_mutable_numeric_parameter(self._offset)
        parameter.SetFromVector(self._processing.offset(reading))

    def observation(
        self, context: Context, X_GB: RigidTransform, reading: np.ndarray
    ) -> np.ndarray:
        """Returns the state (12,) of a pose and a raw reading (6,), as zeroed."""
        offset = context.get_numeric_parameter(self._offset).value()
        return np.asarray(self._processing.state(Pose.of(X_GB), reading, offset))

    def _calc_observation(self, context: Context, output: BasicVector) -> None:
        X_GB = self._X_GB(context)
        reading = self._wrench.Eval(context)
        output.SetFromVector(self.observation(context, X_GB, reading))

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        X_GB = self._X_GB(context)
        output.SetFromVector(pose_to_vector(X_GB))
