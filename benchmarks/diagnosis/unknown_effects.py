"""Effects that the library lacks: what they depend on is all that can be found out.

They are in no library that a runner is given.
"""

import dataclasses
import math

from drake_disasm.common.arrays import Array, as_number, namespace
from drake_disasm.effects import (
    BoltMotion,
    Environment,
    EnvironmentEffect,
    Sensing,
    SensorEffect,
    amplitude,
    register_effect,
    shape_parameter,
)


@register_effect
@dataclasses.dataclass
class SensorBeat(SensorEffect):
    """A reading that swings with time.

    Equation: F_read = F + a sin(2 pi f t) along z_S.
    Where it acts: the reading, after zeroing.
    """

    a: float = amplitude("N", -10.0, 10.0, "of the swing along z_S")
    frequency: float = shape_parameter(0.2, "Hz", 0.01, 5.0, "f", (0.1, 0.2, 0.4))

    present_at_zeroing = False
    noun = "a swing of the reading"
    experiment = "a rest of some minutes"

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the swing at this time."""
        turns = self.column("frequency") * sensing.time[..., None]
        swing = namespace(wrench_S).sin(2.0 * math.pi * turns)
        along = self.vector(wrench_S, "a") * namespace(wrench_S).asarray(_ALONG_Z)
        return wrench_S + swing * along


@register_effect
@dataclasses.dataclass
class SensorCurvature(SensorEffect):
    """A force that is not read in proportion.

    Equation: f_read = f + c f |f| in each axis of S.
    Where it acts: the sensor's elements.
    """

    c: float = amplitude("1/N", -0.1, 0.1, "curvature")

    stage = 2
    noun = "a curved characteristic of the sensor"
    experiment = "several known weights along one axis"

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds what is not in proportion."""
        force = namespace(wrench_S).asarray(_FORCES)
        bent = wrench_S * namespace(wrench_S).abs(wrench_S) * force
        return wrench_S + self.column("c") * bent


@register_effect
@dataclasses.dataclass
class WavyPull(EnvironmentEffect):
    """A pull that swings with the place along the groove, as of worn teeth.

    Equation: f_z = a sin(2 pi x / L) in Gn.
    Where it acts: on the bolt at Bo.
    """

    a: float = amplitude("N", -10.0, 10.0, "of the swing along z_G")
    length: float = shape_parameter(0.015, "m", 0.002, 0.1, "L", (0.01, 0.02))

    is_local = True
    noun = "a pull that swings with the place"
    experiment = "the way along the groove, slowly, both ways"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the pull at this place."""
        x = bolt.p[..., 0]
        pull = self.a * namespace(x).sin(2.0 * math.pi * x / self.length)
        fx, fy, fz = environment.force_Gn
        return dataclasses.replace(environment, force_Gn=(fx, fy, fz + as_number(pull)))


@register_effect
@dataclasses.dataclass
class Flutter(EnvironmentEffect):
    """A pull that swings with time, as of a machine near by.

    Equation: f_y = a sin(2 pi f t) in Gn.
    Where it acts: on the bolt at Bo.
    """

    a: float = amplitude("N", -10.0, 10.0, "of the swing along y_G")
    frequency: float = shape_parameter(0.3, "Hz", 0.01, 5.0, "f", (0.1, 0.3))

    is_local = True
    noun = "a pull that swings with time"
    experiment = "a rest of some minutes in contact"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the pull at this time."""
        pull = self.a * math.sin(2.0 * math.pi * self.frequency * float(bolt.time))
        fx, fy, fz = environment.force_Gn
        return dataclasses.replace(environment, force_Gn=(fx, fy + pull, fz))


_ALONG_Z = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
_FORCES = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
UNKNOWN = (SensorBeat, SensorCurvature, WavyPull, Flutter)
