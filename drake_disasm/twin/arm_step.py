"""A step of the twin's arm, a linear system between command and gripper."""

import dataclasses
import functools

import numpy as np
from scipy.linalg import expm

from drake_disasm.cell.grip import AXIS_ORDER, Springs
from drake_disasm.cell.twin_parameters import ControlledArm
from drake_disasm.common.arrays import Array, apply_matrix, namespace

_ORDER = list(AXIS_ORDER)


@dataclasses.dataclass(frozen=True)
class ArmStep:
    """A step of the controlled arm that carries springs.

    x is (12,): the twin's coordinates of the arm, and their rates; u is (12,): the
    command at the step's end and its rate; s is (12,): the bolt's coordinates and
    rates. Without the springs the arm would go to x' = F x + C u. There the solver of
    contact has the springs' other end, and with what it finds for the bolt the arm
    gets the same force: x+ = x' + P (s+ - x'). That the arm gives way to the force
    within the step is in these springs, which are softer by that.

    Attributes:
        h: the step [s].
        F, C, P: (12, 12).
        G, H: (12, 6) change of x by a steady force, and by one that grows from zero,
            by its rate; both in the coordinates' order.
        springs: between x' and the bolt.
    """

    h: float
    F: np.ndarray
    C: np.ndarray
    P: np.ndarray
    G: np.ndarray
    H: np.ndarray
    springs: Springs

    @classmethod
    def of(cls, arm: ControlledArm, grip: Springs, h: float) -> "ArmStep":
        """Returns the exact step for an even command and an even force.

        Args:
            arm: at the springs' middle, in Gn.
            grip: the springs.
            h: the step [s].
        """
        order = np.ix_(_ORDER, _ORDER)
        M, D, K, B = (m[order] for m in (arm.M, arm.D, arm.K, arm.B))
        one = np.eye(6)
        system = np.zeros((36, 36))  # x, command, its rate, force, its rate
        system[:6, 6:12] = system[12:18, 18:24] = system[24:30, 30:] = one
        pull = np.hstack([-K, -D - B, K, D, one])
        system[6:12, :30] = np.linalg.solve(M, pull)
        step = expm(h * system)[:12]
        by_place, by_rate, G, H = np.split(step[:, 12:], 4, axis=1)
        # The command at the end, not at the beginning.
        C = np.hstack([by_place, by_rate - h * by_place])
        springs = _softer(grip, G)
        return cls(h, step[:, :12], C, G @ _gains(springs), G, H, springs)

    @functools.cached_property
    def table(self) -> Array:
        """F, C and P of each arm, or of one for all (m, 3, 12, 12)."""
        xp = namespace(self.F)
        matrices = xp.stack(xp.broadcast_arrays(self.F, self.C, self.P), axis=-3)
        return matrices if matrices.ndim > 3 else matrices[None]

    def ahead(self, x: Array, u: Array) -> Array:
        """Returns x' (n, 12) for states and commands (n, 12)."""
        return apply_matrix(self.F, x) + apply_matrix(self.C, u)

    @property
    def is_stable(self) -> bool:
        """Whether an arm that leans on a bolt in contact comes to rest."""
        return bool(np.abs(np.linalg.eigvals(self.F - self.P @ self.F)).max() < 1.0)


def _gains(springs: Springs) -> np.ndarray:
    """Returns force by coordinates and rates (6, 12), in the coordinates' order."""
    parts = (springs.stiffness, springs.damping)
    return np.hstack([np.diag(values[_ORDER]) for values in parts])


def _softer(grip: Springs, G: np.ndarray) -> Springs:
    """Returns the springs in series with what a force moves an arm in one step.

    Of each axis by itself; what one axis does to another is left out.

    Args:
        grip: the springs.
        G: (12, 6) change of the arm's state by a force in the step.
    """
    gains = _gains(grip)
    whole = np.linalg.solve(np.eye(6) + gains @ G, gains)
    back = np.argsort(_ORDER)
    return Springs(np.diag(whole[:, :6])[back], np.diag(whole[:, 6:])[back])
