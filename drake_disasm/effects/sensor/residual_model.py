"""What a sensor's model leaves, as a learned function; not physical."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.common.arrays import Array, array_like, namespace, to_numpy
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude, file_name
from drake_disasm.effects.learned import learned_functions
from drake_disasm.effects.registry import register_effect

_WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


@register_effect
@dataclasses.dataclass
class SensorResidualModel(SensorEffect):
    """What no effect explains of a sensor's readings, learned; it is not physical.

    Equation: w += share h(w, g_S, t) with h boosted regression trees (Friedman 2001) of
    the reading, of gravity in the sensor's frame and of time; zero where any of them is
    outside the range of the data that h was made of. Closing the loop makes it.
    Where it acts: the reading, after all other effects.
    """

    file: str = file_name()
    share: float = amplitude("1", 0.0, 1.0, "of the learned function that acts")

    is_physical: ClassVar[bool] = False
    inputs: ClassVar[tuple[str, ...]] = (*_WRENCH, "gx", "gy", "gz", "time")

    stage = 5
    present_at_zeroing = False
    noun = "a learned model of the readings"
    experiment = "what shows an effect of which this is the trace"

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """See SensorEffect."""
        if self.is_null:
            return wrench_S
        functions = learned_functions(self.file, self.inputs)
        inputs = to_numpy(self.inputs_of(wrench_S, sensing))
        added = np.zeros((len(inputs), len(_WRENCH)))
        for name, function in functions.outputs.items():
            added[:, _WRENCH.index(name)] = function(inputs)
        found = array_like(added.reshape(wrench_S.shape), wrench_S)
        return wrench_S + self.column("share") * found

    @staticmethod
    def inputs_of(wrench_S: Array, sensing: Sensing) -> Array:
        """Returns what the functions take (n, 10), of readings (..., 6)."""
        xp, leading = namespace(wrench_S), wrench_S.shape[:-1]
        g_S = xp.broadcast_to(sensing.g_S, (*leading, 3))
        time = xp.broadcast_to(xp.asarray(sensing.time), leading)[..., None]
        both = xp.concat([wrench_S, g_S, time], axis=-1)
        return xp.reshape(both, (-1, both.shape[-1]))
