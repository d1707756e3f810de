"""The arm in the twin's diagram: between the command and the gripper's springs."""

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import LinearSystem, MatrixGain, Multiplexer

from drake_disasm.twin.arm_step import ArmStep


class ArmNode:
    """The arm's systems in a twin's diagram.

    Drake updates a plant (an unrestricted update) before other discrete states at the
    same time: the arm's update sees the bolt after the step.

    Attributes:
        system: the arm, whose discrete state is (12,).
        state: port of the arm's coordinates and rates (12,), which its encoders see.
        ahead: port of where it would be after the step without springs.

    Args:
        builder: of the station.
        step: of the plant's length.
        time_step: h [s].
        inputs: ports of command (6,), its rate (6,) and the bolt's state (12,).
    """

    def __init__(
        self,
        builder: DiagramBuilder,
        step: ArmStep,
        time_step: float,
        inputs: tuple[OutputPort, OutputPort, OutputPort],
    ) -> None:
        A, B, ahead = _matrices(step)
        self.system = builder.AddNamedSystem(
            "arm", LinearSystem(A, B, np.eye(12), np.zeros((12, 24)), time_step)
        )
        self._ahead = builder.AddNamedSystem("arm_ahead", MatrixGain(ahead))
        driven = builder.AddNamedSystem("arm_inputs", Multiplexer([6, 6, 12]))
        commanded = builder.AddNamedSystem("arm_commanded", Multiplexer([12, 6, 6]))
        for i, port in enumerate(inputs):
            builder.Connect(port, driven.get_input_port(i))
        self.state = self.system.get_output_port()
        for i, port in enumerate((self.state, *inputs[:2])):
            builder.Connect(port, commanded.get_input_port(i))
        builder.Connect(driven.get_output_port(), self.system.get_input_port())
        builder.Connect(commanded.get_output_port(), self._ahead.get_input_port())
        self.ahead = self._ahead.get_output_port()

    def set_step(self, step: ArmStep) -> None:
        """Gives the arm other numbers; they belong to the diagram, not a Context."""
        A, B, ahead = _matrices(step)
        zero = np.zeros(12)
        self.system.UpdateCoefficients(
            A=A, B=B, f0=zero, C=np.eye(12), D=np.zeros((12, 24)), y0=zero
        )
        self._ahead.UpdateCoefficients(
            B=np.zeros((0, 24)), C=np.zeros((12, 0)), D=ahead, y0=zero
        )


def _matrices(step: ArmStep) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns A (12, 12) and B (12, 24) of x+ = A x + B [u; s+], and x' by [x; u]."""
    ahead = np.hstack([step.F, step.C])
    driven = ahead - step.P @ ahead
    return driven[:, :12], np.hstack([driven[:, 12:], step.P]), ahead
