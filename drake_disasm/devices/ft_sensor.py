"""The force/torque sensor, as the simulated stations carry it."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.tree import BodyIndex, JointIndex
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_disasm.effects import Sensing, SensorEffect
from drake_disasm.ports import Health
from drake_disasm.scenario import SensorConfig
from drake_disasm.spatial import wrench_from_spatial_force
from drake_disasm.timing import newest_step


class ForceTorqueSensor(LeafSystem):
    """Turns a joint's reaction into what an OnRobot HEX-E would report.

    The reading is the load on the sensor at So in S, [f; tau], untared: a mass
    that hangs on it reads downwards. It is minus the joint's reaction on the
    sensor (Drake's, [tau; f]), through the effects, plus noise, in whole counts.
    While there has been no step yet, `health` is NO_DATA.

    @system
    name: ForceTorqueSensor
    input_ports:
    - reaction_forces
    - body_poses
    - noise
    output_ports:
    - wrench
    - health
    - time_measured
    @endsystem

    Args:
        config: noise and quantum per channel.
        joint: the joint whose reaction is read, its child frame being S.
        body: a body that S is fixed to, and X_BodyS its pose there.
        g_W: gravity (3,) [m/s^2].
        time_step: of the plant whose reaction is read [s].
    """

    def __init__(
        self,
        config: SensorConfig,
        joint: JointIndex,
        body: BodyIndex,
        X_BodyS: RigidTransform,
        g_W: np.ndarray,
        time_step: float,
    ) -> None:
        super().__init__()
        self._noise, self._quantum = np.array(config.noise), np.array(config.quantum)
        self._joint, self._body = int(joint), int(body)
        self._R_BodyS, self._g_W = X_BodyS.rotation(), g_W
        self._time_step = time_step
        self._effects = self.DeclareAbstractParameter(Value[object](()))
        self._reaction = self.DeclareAbstractInputPort(
            "reaction_forces", Value[list[SpatialForce]]()
        )
        self._poses = self.DeclareAbstractInputPort(
            "body_poses", Value[list[RigidTransform]]()
        )
        self._noise_port = self.DeclareVectorInputPort("noise", 6)
        self._declare_outputs()

    def _declare_outputs(self) -> None:
        # Not the time: between two plant steps the sensor has no new sample, and
        # what depends on time takes that of the newest step.
        reaction = self._reaction.ticket()
        self.DeclareVectorOutputPort(
            "wrench",
            6,
            self._calc_wrench,
            prerequisites_of_calc={
                reaction,
                self._poses.ticket(),
                self._noise_port.ticket(),
                self.all_parameters_ticket(),
            },
        )
        self.DeclareVectorOutputPort(
            "health", 1, self._calc_health, prerequisites_of_calc={reaction}
        )
        self.DeclareVectorOutputPort("time_measured", 1, self._calc_time)

    def set_effects(self, context: Context, effects: Sequence[SensorEffect]) -> None:
        """Puts the effects, in their order, into this system's Context."""
        parameter = context.get_mutable_abstract_parameter(self._effects)
        parameter.set_value(tuple(effects))

    def reading_at_zeroing(self, context: Context) -> np.ndarray:
        """Returns the noise-free mean (6,) of readings that zeroing averages.

        Whenever it is taken, zeroing is time 0 for the effects: the episode begins.
        """
        effects = [e for e in self.effects(context) if e.present_at_zeroing]
        return self._through(context, effects, time=0.0)

    def effects(self, context: Context) -> Sequence[SensorEffect]:
        """Returns what `set_effects` put there."""
        return context.get_abstract_parameter(self._effects).get_value()

    def _through(
        self, context: Context, effects: Sequence[SensorEffect], time: float
    ) -> np.ndarray:
        load = -wrench_from_spatial_force(self._reaction.Eval(context)[self._joint])
        if not effects:
            return load
        R_WBody = self._poses.Eval(context)[self._body].rotation()
        R_WS = (R_WBody @ self._R_BodyS).matrix()
        return sensed(load, effects, Sensing(np.array(time), R_WS, self._g_W))

    def _calc_wrench(self, context: Context, output: BasicVector) -> None:
        effects = self.effects(context)
        wrench = self._through(context, effects, self._sample_time(context))
        wrench = wrench + self._noise * self._noise_port.Eval(context)
        output.SetFromVector(quantise(wrench, self._quantum))

    def _calc_health(self, context: Context, output: BasicVector) -> None:
        F = self._reaction.Eval(context)[self._joint]
        stepped = np.any(F.get_coeffs() != 0.0)
        output.SetFromVector([Health.READY if stepped else Health.NO_DATA])

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._sample_time(context)])

    def _sample_time(self, context: Context) -> float:
        return newest_step(context.get_time(), self._time_step)


def sensed(
    load: np.ndarray, effects: Sequence[SensorEffect], sensing: Sensing
) -> np.ndarray:
    """Returns what a sensor with effects reads of loads, (..., 6) [f; tau] in S."""
    for effect in effects:
        load = effect.apply(load, sensing)
    return load


def quantise(values: np.ndarray, quantum: np.ndarray) -> np.ndarray:
    """Returns values rounded to whole multiples; a zero quantum leaves them."""
    if quantum.all():
        return np.rint(values / quantum) * quantum
    step = np.where(quantum > 0.0, quantum, 1.0)
    return np.where(quantum > 0.0, np.rint(values / step) * step, values)
