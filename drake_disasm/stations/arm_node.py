"""The twin's arm: a linear system between the command and the gripper's springs."""

import dataclasses

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import LinearSystem, MatrixGain, Multiplexer
from scipy.linalg import expm

from drake_disasm.cell.grip import AXIS_ORDER, Springs
from drake_disasm.cell.twin_parameters import ControlledArm

_ORDER = list(AXIS_ORDER)


@dataclasses.dataclass(frozen=True)
class ArmStep:
    """A step of the controlled arm that carries springs: x+ = A x + B u.

    x is (12,): the twin's coordinates of the arm, and their rates. u is (24,): command
    at the step's end and its rate, the bolt's coordinates and rates at its beginning.

    Attributes:
        A, B: (12, 12), (12, 24).
    """

    A: np.ndarray
    B: np.ndarray

    @classmethod
    def of(cls, arm: ControlledArm, grip: Springs, h: float) -> "ArmStep":
        """Returns the exact step for a command that moves evenly.

        The force of the springs is that at the step's beginning, since the solver of
        contact has the bolt's motion only afterwards; the arm is heavy against it.

        Args:
            arm: at the springs' middle, in Gn.
            grip: the springs.
            h: the step [s].
        """
        M, D, K = (m[np.ix_(_ORDER, _ORDER)] for m in (arm.M, arm.D, arm.K))
        one = np.eye(6)
        rate = np.linalg.solve(M, np.hstack([-K, -D, K, D, one]))
        system = np.zeros((30, 30))  # x, command, its rate, force
        system[:6, 6:12] = one
        system[6:12] = rate
        system[12:18, 18:24] = one
        step = expm(h * system)[:12]
        by_place, by_rate, by_force = step[:, 12:18], step[:, 18:24], step[:, 24:]
        springs = by_force @ np.hstack(
            [np.diag(values[_ORDER]) for values in (grip.stiffness, grip.damping)]
        )
        # The command at the end, not at the beginning.
        B = np.hstack([by_place, by_rate - h * by_place, springs])
        return cls(step[:, :12] - springs, B)

    @property
    def is_stable(self) -> bool:
        """Whether an arm that leans on a bolt in contact comes to rest."""
        return bool(np.abs(np.linalg.eigvals(self.A)).max() < 1.0)


class ArmNode:
    """The arm's systems in a twin's diagram.

    Attributes:
        state: port of the arm's coordinates and rates (12,), which its encoders see.
        desired: port of the same at the end of the step, for the springs behind it.

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
        I, none = np.eye(12), np.zeros((12, 24))  # noqa: E741
        self._h = time_step
        self._arm = builder.AddNamedSystem(
            "arm", LinearSystem(step.A, step.B, I, none, time_step)
        )
        self._ahead = builder.AddNamedSystem(
            "arm_ahead", MatrixGain(np.hstack([step.A, step.B]))
        )
        driven = builder.AddNamedSystem("arm_inputs", Multiplexer([6, 6, 12]))
        whole = builder.AddNamedSystem("arm_state_and_inputs", Multiplexer([12, 24]))
        for i, port in enumerate(inputs):
            builder.Connect(port, driven.get_input_port(i))
        builder.Connect(driven.get_output_port(), self._arm.get_input_port())
        builder.Connect(self._arm.get_output_port(), whole.get_input_port(0))
        builder.Connect(driven.get_output_port(), whole.get_input_port(1))
        builder.Connect(whole.get_output_port(), self._ahead.get_input_port())
        self.state = self._arm.get_output_port()
        self.desired = self._ahead.get_output_port()

    def set_step(self, step: ArmStep) -> None:
        """Gives the arm other numbers; they belong to the diagram, not a Context."""
        I, zero = np.eye(12), np.zeros(12)  # noqa: E741
        self._arm.UpdateCoefficients(
            A=step.A, B=step.B, f0=zero, C=I, D=np.zeros((12, 24)), y0=zero
        )
        self._ahead.UpdateCoefficients(
            B=np.zeros((0, 36)),
            C=np.zeros((12, 0)),
            D=np.hstack([step.A, step.B]),
            y0=zero,
        )

    @property
    def system(self) -> LinearSystem:
        """The arm, whose discrete state is (12,)."""
        return self._arm
