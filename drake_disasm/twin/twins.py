"""What many twins are made of, and what acts in them: equations without a state."""

import dataclasses
import functools

from drake_disasm.cell.grip import in_joint_order
from drake_disasm.common.arrays import Array
from drake_disasm.common.spatial import shifted_wrench
from drake_disasm.effects import BoltMotion, Environment, Sensing
from drake_disasm.systems.observation import StateFromReadings
from drake_disasm.twin.conditions import ImpactConditions
from drake_disasm.twin.numbers import TwinNumbers
from drake_disasm.twin.plant import Plant, PlantStep
from drake_disasm.twin.slots import BatchEffects


@dataclasses.dataclass(frozen=True)
class Twins:
    """n twins with their effects.

    Attributes:
        numbers: of the twins.
        effects: theirs.
        is_exact: whether readings are processed exactly, or as the thesis does.
        at_A: the bolts at rest at A, (n, 3) each.
        threads: of the host, which share the twins.
    """

    numbers: TwinNumbers
    effects: BatchEffects
    is_exact: bool
    at_A: BoltMotion
    threads: int = 1

    @property
    def processing(self) -> StateFromReadings:
        """Of the readings."""
        return StateFromReadings(self.numbers.mounting, self.is_exact)

    @functools.cached_property
    def plant_at_A(self) -> Plant:
        """The plants of bolts at A; everywhere, unless effects depend on the motion."""
        return self._plant(self.at_A)

    def plant(self, motion: BoltMotion) -> Plant:
        """Returns the plants, in the environments that effects make.

        Args:
            motion: (n, 3) each, of the bolts, on which effects may depend.
        """
        return self._plant(motion) if self.effects.is_local else self.plant_at_A

    def _plant(self, motion: BoltMotion) -> Plant:
        numbers = self.numbers
        K, D = in_joint_order(numbers.arm.springs)
        conditions = ImpactConditions.of(
            numbers.law,
            numbers.gaps,
            self.environment(motion),
            motion.p,
            M=numbers.M,
            K=K,
            D=D,
            p_BoTo_B=numbers.body.p_BoTo_B,
        )
        return Plant(numbers.arm, numbers.body, conditions, self.threads)

    def environment(self, motion: BoltMotion) -> Environment:
        """Returns the bolts' environments; see `plant`."""
        environment = self.numbers.nominal
        for effect in self.effects.environment:
            environment = effect.apply(environment, motion)
        return environment

    def load_S(self, arm: Array, step: PlantStep) -> Array:
        """Returns the load on the sensor (n, 6), [f; tau] at So in S.

        Args:
            arm: (n, 12) where encoders have the sensor.
            step: of the plant.
        """
        numbers, coordinates = self.numbers, self.numbers.coordinates
        mounting = numbers.mounting
        if mounting.X_GS is not None:
            there = mounting.from_bolt(coordinates.poses(step.q_before)).inverse()
            on_part = shifted_wrench(step.on_part, there.R, there.p)
            return on_part + mounting.weight_at_start
        X_GB, bolt = coordinates.poses(arm[:, :6]), coordinates.poses(step.state.q)
        X_SGn = mounting.X_SB @ X_GB.inverse()
        return shifted_wrench(step.load(numbers.body), X_SGn.R, X_SGn @ bolt.p)

    def sensing(self, arm: Array, time: Array) -> Sensing:
        """Returns the circumstances of readings.

        Args:
            arm: see `load_S`.
            time: (n,) since the episodes began [s].
        """
        numbers, mounting = self.numbers, self.numbers.mounting
        R_GS = mounting.from_bolt(numbers.coordinates.poses(arm[:, :6])).R
        return mounting.payload.sensing(time, mounting.R_WS(R_GS))


def at_A(like: Array) -> BoltMotion:
    """Returns bolts at rest at A, as many as an array (n, ...) has rows."""
    nothing = 0.0 * like[:, :3]
    return BoltMotion(nothing, nothing, nothing[:, 0])
