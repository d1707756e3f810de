"""What many twins are made of, and what acts in them: equations without a state."""

import dataclasses

from drake_disasm.common.arrays import Array, array_like, namespace
from drake_disasm.common.spatial import shifted_wrench
from drake_disasm.effects import BoltMotion, Environment, Sensing
from drake_disasm.systems.observation import StateFromReadings
from drake_disasm.twin import ImpactConditions, Surroundings
from drake_disasm.twin.motion import PlantStep
from drake_disasm.twin.numbers import TwinNumbers
from drake_disasm.twin.own_effects import with_effect
from drake_disasm.twin.slots import BatchEffects


@dataclasses.dataclass(frozen=True)
class Twins:
    """n twins with their effects.

    Attributes:
        numbers: of the twins.
        effects: theirs.
        is_exact: whether readings are processed exactly, or as the thesis does.
    """

    numbers: TwinNumbers
    effects: BatchEffects
    is_exact: bool

    @property
    def processing(self) -> StateFromReadings:
        """Of the readings."""
        return StateFromReadings(self.numbers.mounting, self.is_exact)

    def conditions(self, motion: BoltMotion) -> ImpactConditions:
        """Returns the contact's conditions.

        Args:
            motion: (n, 3) each, of the bolts, on which effects may depend.
        """
        environment = self.numbers.nominal
        for effect in self.effects.environment:
            if not effect.is_null:
                environment = with_effect(effect, environment, motion)
        return self.numbers.conditions(environment, _around(environment, motion.p))

    def load_S(self, arm: Array, step: PlantStep) -> Array:
        """Returns the load on the sensor (n, 6), [f; tau] at So in S.

        Args:
            arm: (n, 12) where encoders have the sensor.
            step: of the plant.
        """
        numbers, coordinates = self.numbers, self.numbers.coordinates
        X_GB, bolt = coordinates.poses(arm[:, :6]), coordinates.poses(step.state.q)
        X_SGn = numbers.mounting.X_SB @ X_GB.inverse()
        return shifted_wrench(step.load(numbers.body), X_SGn.R, X_SGn @ bolt.p)

    def sensing(self, arm: Array, time: Array) -> Sensing:
        """Returns the circumstances of readings.

        Args:
            arm: see `load_S`.
            time: (n,) since the episodes began [s].
        """
        numbers = self.numbers
        R_GB = numbers.coordinates.poses(arm[:, :6]).R
        R_GS = namespace(R_GB).matmul(R_GB, numbers.mounting.X_BS.R)
        return numbers.payload.sensing(time, numbers.mounting.R_WS(R_GS))


def at_A(like: Array) -> BoltMotion:
    """Returns bolts at rest at A, as many as an array (n, ...) has rows."""
    nothing = 0.0 * like[:, :3]
    return BoltMotion(nothing, nothing, nothing[:, 0])


def _around(environment: Environment, like: Array) -> Surroundings:
    """Returns what may differ from twin to twin, (n, ...) of a kind with (n, 3)."""
    xp, count, X_GnG = namespace(like), len(like), environment.X_GnG
    f_Gn = [
        xp.broadcast_to(array_like(f, like), (count,)) for f in environment.force_Gn
    ]
    return Surroundings(
        xp.broadcast_to(array_like(environment.friction, like), (count,)),
        xp.broadcast_to(X_GnG.rotation(), (count, 3, 3)),
        xp.broadcast_to(X_GnG.translation(), (count, 3)),
        xp.stack(f_Gn, axis=1),
    )
