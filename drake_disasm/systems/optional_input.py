"""An input that may stay unconnected, which none of Drake's own systems allows."""

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem


class OptionalInput(LeafSystem):
    """Passes a vector through; a constant one if nothing is connected.

    The output is cached by the input's ticket: Python is called when the input
    changes, not in each step of the plant.

    @system
    name: OptionalInput
    input_ports:
    - value
    output_ports:
    - value
    @endsystem

    Args:
        default: (n,) what is put out while the input is not connected.
    """

    def __init__(self, default: np.ndarray) -> None:
        super().__init__()
        self._default = np.array(default, dtype=float)
        self._value = self.DeclareVectorInputPort("value", len(self._default))
        self.DeclareVectorOutputPort(
            "value",
            len(self._default),
            self._calc,
            prerequisites_of_calc={self._value.ticket()},
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        connected = self._value.HasValue(context)
        output.SetFromVector(self._value.Eval(context) if connected else self._default)
