"""What an arm's model leaves of its torques, as a learned function; not physical."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.effects.base import ArmSamples, ArmTorqueEffect
from drake_disasm.effects.fields import amplitude, file_name
from drake_disasm.effects.learned import learned_functions
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class ArmResidualModel(ArmTorqueEffect):
    """What no effect explains of an arm's torques, learned; it is not physical.

    Equation: tau_i = share h_i(q_i, v_i, vd_i, load_i) with h_i boosted regression
    trees (Friedman 2001) of the joint's own motion and load; zero where any of them
    is outside the range of the data that h_i was made of. Closing the loop makes it.
    Where it acts: the torques that the joints' sensors measure.
    """

    file: str = file_name()
    share: float = amplitude("1", 0.0, 1.0, "of the learned function that acts")

    is_physical: ClassVar[bool] = False
    inputs: ClassVar[tuple[str, ...]] = ("q", "v", "vd", "load")

    is_filtered = True
    noun = "a learned model of the torques"
    experiment = "what shows an effect of which this is the trace"

    def torques(self, samples: ArmSamples) -> np.ndarray:
        """See ArmTorqueEffect."""
        added = np.zeros_like(samples.load)
        if self.is_null:
            return added
        functions = learned_functions(self.file, self.inputs)
        for joint, function in functions.outputs.items():
            inputs = self.inputs_of(samples, joint)
            found = function(inputs.reshape(-1, inputs.shape[-1]))
            added[..., samples.joints.index(joint)] = found.reshape(inputs.shape[:-1])
        return self.column("share") * added

    @staticmethod
    def inputs_of(samples: ArmSamples, joint: str) -> np.ndarray:
        """Returns what the function of a joint takes, (..., n, 4)."""
        own = samples.of(joint)
        return np.stack([own.q, own.v, own.vd, own.load], axis=-1)
