"""The contact in one step of the twin, for many states at once."""

import dataclasses
from typing import Self

import numpy as np

from drake_disasm.twin.conditions import ImpactConditions
from drake_disasm.twin.equations import solve_rows

#: What an error says.
NO_BALANCE = "IMPACT contact: no force balances this step"


@dataclasses.dataclass(frozen=True)
class ImpactStep:
    """What a step of the plant with contact comes to, for n states.

    The law is stiff: taken at the start of a step it explodes long before the upper
    bounds of the thesis. The plant's step without contact is linear in the twin's six
    joints, so the velocities v+ after it solve

        (M + h D + h^2 K) v+ = M v + h K (qd - q) + h D vd + h J^T f(q + h v+, v+)

    by Newton's method; f is IMPACT's at the end of the step, with Coulomb friction,
    regularised. The unknown is the bolt's twist [velocity of To; angular velocity] in
    G, T v+, where the groove's normals are the axes. Vectors are in Gn unless a name
    says G. States don't see each other: what one gives does not depend on its company.

    Attributes:
        v: (n, 6) v+.
        wrench: (n, 6) of the contact on the bolt at Bo, [f; tau].
        is_solved: (n,) whether there is a balance.
    """

    v: np.ndarray
    wrench: np.ndarray
    is_solved: np.ndarray

    @classmethod
    def of(
        cls,
        conditions: ImpactConditions,
        h: float,
        q: np.ndarray,
        v: np.ndarray,
        qd: np.ndarray,
        vd: np.ndarray,
    ) -> Self:
        """Finds the step.

        Args:
            conditions: of the contact.
            h: the step [s].
            q, v: (n, 6) the twin's coordinates and their rates.
            qd, vd: (n, 6) commanded ones.
        """
        rows = tuple(np.ascontiguousarray(each) for each in (q, v, qd, vd))
        after, wrench = np.empty(q.shape), np.empty(q.shape)
        is_solved = np.zeros(len(q), np.bool_)
        no_body = np.zeros((1, 16))
        solve_rows(conditions.table, no_body, h, rows, after, wrench, is_solved)
        return cls(after, wrench, is_solved)
