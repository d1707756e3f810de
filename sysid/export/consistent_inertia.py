"""Inertias that a body can have, and that give an arm's identified base parameters.

Torques determine base parameters beta = B pi alone; pi are the links' ten inertial
parameters each. Of all pi with that beta, the one is sought whose bodies are physical
and closest to the nominal ones. A body is physical if its pseudo-inertia

    P = [[1/2 tr(I) 1 - I, c], [c^T, m]]

is positive definite (Wensing, Kim and Slotine 2018, "Linear matrix inequalities for
physically consistent inertial parameter identification"). Closeness is the sum over
links of the log-det divergence tr(P0^-1 P) - log det(P0^-1 P) - 4, which depends on no
choice of frames or units (Lee, Wensing and Park 2020, "Geometric robot dynamic
identification: a convex programming approach").

The unknowns are X = L^-1 P L^-T with P0 = L L^T: the nominal body is X = 1.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from pydrake.solvers import (
    ClarabelSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    ScsSolver,
    SolutionResult,
)
from scipy.linalg import block_diag, null_space
from scipy.stats import chi2

from drake_disasm.common.errors import DisasmError
from sysid.models.regressor import INERTIAL

Array = NDArray[np.float64]

_SIZE = len(INERTIAL)
#: Where m, c and the upper triangle of I stand.
_UPPER = np.triu_indices(3)
_LOWER4 = np.tril_indices(4)
#: Of a nominal body's largest principal second moment: it has at least that in every
#: direction. Rods and points of mass have none in some, and no body is one.
_THINNEST = 1e-3
#: What stands for a link that moves and has no mass in the file: an aluminium ball.
_BALL_MASS, _DENSITY = 0.1, 2700.0  # kg, kg/m^3
#: Of the divergence, in units of the squared distance, where no physical arm has the
#: identified base parameters. With one the sum is that of a likelihood and a prior;
#: less is tried where that leads out of the joint interval. With none, bodies would be
#: at the edge of what is physical.
_WEIGHTS = (10.0, 1.0, 0.1, 0.01)
_JOINT_LEVEL = 0.95
#: A body whose X has a smaller eigenvalue is at the edge: its mass is in a plane.
_EDGE = 1e-9
_NEWTON_STEPS = 200
_FULL_STEP, _CONVERGED = 0.25, 1e-9  # decrements
_UNDETERMINED = 1e-9  # of the largest eigenvalue of a correlation
_INFEASIBLE = SolutionResult.kInfeasibleConstraints
_LEAST_COLUMN = 1e-9  # of the largest: a link with less has no effect on any torque


@dataclass(frozen=True)
class ConsistentInertia:
    """Physical bodies with identified base parameters.

    Attributes:
        inertia: pi of all links, INERTIAL each.
        beta: its base parameters.
        distance: squared, from the identified ones, in units of their covariance; zero
            if they are the same.
        limit: of that distance, for the joint interval of 95 %.
        divergence: log-det, from the nominal bodies.
        changed: numbers of the links that are not as in the nominal.
    """

    inertia: Array
    beta: Array
    distance: float
    limit: float
    divergence: float
    changed: tuple[int, ...]

    @property
    def is_exact(self) -> bool:
        """Whether the base parameters are the identified ones."""
        return self.distance == 0.0


def consistent_inertia(
    B: Array,
    nominal: Array,
    beta: Array,
    covariance: Array,
    held: Mapping[int, float] = MappingProxyType({}),
) -> ConsistentInertia:
    """Returns the physical bodies closest to nominal ones that have base parameters.

    If there are none, those whose base parameters are closest to the given ones in
    units of their covariance.

    Args:
        B: (b, parameters) which combinations of pi are known, see `BaseSet.matrix`.
        nominal: pi of all links.
        beta: (b,) identified base parameters.
        covariance: (b, b) of their error.
        held: values of elements of pi that are known, by their number.

    Raises:
        DisasmError: no physical arm is within the joint interval of 95 %.
    """
    bodies = _Bodies.of(B, nominal, held)
    W = whitening(covariance)
    limit = float(chi2.ppf(_JOINT_LEVEL, max(1, len(W))))
    x, distance = bodies.exact(beta), 0.0
    if x is None:
        x, distance = _closest(bodies, beta, W, limit)
    if distance > limit:
        raise DisasmError(
            "export: no physical inertia gives the identified base parameters; the "
            f"closest is {np.sqrt(distance / limit):.3g} times as far off as their "
            "joint 95 % interval reaches; record faster and wider motion, or check "
            "signs, units and motor constants of the torques"
        )
    pi = bodies.inertia(x)
    return ConsistentInertia(
        pi, B @ pi, distance, limit, bodies.divergence(x), bodies.changed(x)
    )


def _closest(
    bodies: "_Bodies", beta: Array, W: Array, limit: float
) -> tuple[Array, float]:
    """Returns unknowns close to base parameters, and the squared distance.

    The closest to the nominal bodies of those that are tried and within the limit.
    """
    for weight in _WEIGHTS:
        x = bodies.closest(beta, W, weight)
        distance = float(np.sum((W @ (bodies.beta(x) - beta)) ** 2))
        if distance <= limit:
            break
    return x, distance


@dataclass(frozen=True)
class _Bodies:
    """The bodies of an arm as unknowns X.

    Attributes:
        nominal: pi of all links, with balls for those that lack mass.
        links: numbers of those that may change.
        roots: (links, 4, 4) L of each.
        A: (b, 10 links) base parameters by the lower triangles of X.
        rest: (b,) what the other links give.
        held, values: (h, 10 links) and (h,) elements of pi that are known.
    """

    nominal: Array
    links: tuple[int, ...]
    roots: Array
    A: Array
    rest: Array
    held: Array
    values: Array

    @classmethod
    def of(cls, B: Array, nominal: Array, held: Mapping[int, float]) -> "_Bodies":
        """Returns the unknowns of an arm."""
        columns = np.linalg.norm(B, axis=0).reshape(-1, _SIZE).max(axis=1)
        moves = columns > _LEAST_COLUMN * columns.max()
        has_mass = nominal[::_SIZE] > 0.0
        if not (moves & has_mass).any():
            nominal, has_mass = nominal.copy(), moves
            nominal.reshape(-1, _SIZE)[moves] = ball(_BALL_MASS)
        links = tuple(int(i) for i in np.flatnonzero(moves & has_mass))
        roots = np.stack([_root(nominal.reshape(-1, _SIZE)[i]) for i in links])
        to_pi = np.zeros((len(nominal), _SIZE * len(links)))
        for number, (i, L) in enumerate(zip(links, roots, strict=True)):
            own = slice(number * _SIZE, (number + 1) * _SIZE)
            to_pi[i * _SIZE : (i + 1) * _SIZE, own] = _to_inertial(L)
        kept = nominal.copy()
        kept.reshape(-1, _SIZE)[list(links)] = 0.0
        values = np.array(list(held.values()))
        rows = to_pi[np.array(list(held), dtype=np.int64)]
        return cls(nominal, links, roots, B @ to_pi, B @ kept, rows, values)

    def beta(self, x: Array) -> Array:
        """Returns the base parameters (b,) of unknowns."""
        return self.rest + self.A @ x

    def inertia(self, x: Array) -> Array:
        """Returns pi of all links."""
        pi = self.nominal.copy().reshape(-1, _SIZE)
        parts = zip(self.links, self.roots, x.reshape(-1, _SIZE), strict=True)
        for link, L, own in parts:
            pi[link] = _to_inertial(L) @ own
        return pi.reshape(-1)

    def divergence(self, x: Array) -> float:
        """Returns the log-det divergence from the nominal bodies."""
        X = _matrices(x)
        logs = np.linalg.slogdet(X)[1]
        return float(np.sum(np.trace(X, axis1=1, axis2=2) - logs - 4.0))

    def changed(self, x: Array) -> tuple[int, ...]:
        """Returns the numbers of the links that are not as in the nominal."""
        off = np.abs(_matrices(x) - np.eye(4)).max(axis=(1, 2))
        return tuple(i for i, size in zip(self.links, off, strict=True) if size > _EDGE)

    def exact(self, beta: Array) -> Array | None:
        """Returns unknowns with exactly these base parameters; None: there are none.

        A semidefinite program finds bodies as far as possible from the edge of what is
        physical, or that there are none; Newton's steps go on from there.
        """
        A, b = _scaled(
            np.vstack([self.A, self.held]),
            np.concatenate([beta - self.rest, self.values]),
        )
        program = MathematicalProgram()
        x = self._unknowns(program)
        least = program.NewContinuousVariables(1, "least")
        program.AddLinearEqualityConstraint(A, b, x)
        with np.errstate(all="ignore"):  # symbols are NaN on the way
            shifted = [X - least[0] * np.eye(4) for X in _symbols(x)]
        for each in shifted:
            program.AddPositiveSemidefiniteConstraint(each)
        program.AddBoundingBoxConstraint(-np.inf, 1.0, least)  # as of the nominal
        program.AddLinearCost(-least[0])
        result = _solved(program)
        if result is None:
            return None
        value = result.GetSolution(x)
        value = value + np.linalg.lstsq(A, b - A @ value, rcond=None)[0]
        return _nearest(value, null_space(A)) if _is_physical(value) else None

    def closest(self, beta: Array, W: Array, weight: float) -> Array:
        """Returns the unknowns closest to base parameters by their covariance.

        Args:
            beta: (b,) base parameters.
            W: (k, b) with W^T W the inverse of their covariance.
            weight: of the divergence from the nominal bodies.
        """
        A, b = W @ self.A, W @ (beta - self.rest)
        program = MathematicalProgram()
        x = self._unknowns(program)
        # The size of the cost is what solvers' tolerances refer to.
        at_nominal = np.tile(np.eye(4)[_LOWER4], len(self.links))
        scale = max(1.0, float(np.linalg.norm(A @ at_nominal - b)))
        program.Add2NormSquaredCost(A / scale, b / scale, x)
        if len(self.held):
            program.AddLinearEqualityConstraint(*_scaled(self.held, self.values), x)
        self._add_divergence(program, x, weight / scale**2)
        result = _solved(program)
        value = None if result is None else result.GetSolution(x)
        if value is None or not _is_physical(value):
            raise DisasmError(
                "export: no physical inertia gives the identified base parameters, or "
                "any near by; check signs, units and motor constants of the torques"
            )
        return np.asarray(value)

    def _unknowns(self, program: MathematicalProgram) -> Array:
        return np.asarray(program.NewContinuousVariables(_SIZE * len(self.links), "x"))

    def _add_divergence(
        self, program: MathematicalProgram, x: Array, weight: float
    ) -> None:
        """Adds the log-det divergence to the cost, and that bodies are physical."""
        for X in _symbols(x):
            program.AddLinearCost(weight * sum(np.diagonal(X)))
            cost, t, _ = program.AddMaximizeLogDeterminantCost(X)
            if weight != 1.0:
                program.RemoveCost(cost)
                program.AddLinearCost(-weight * np.ones(len(t)), 0.0, t)


def _solved(program: MathematicalProgram) -> MathematicalProgramResult | None:
    """Returns the solution by the first solver that has one; None: there is none."""
    for solver in (ClarabelSolver(), ScsSolver()):
        if solver.available():
            result = solver.Solve(program)
            if result.is_success():
                return result
            if result.get_solution_result() == _INFEASIBLE:
                return None
    return None


def _symbols(x: Array) -> Iterator[Array]:
    """Yields X (4, 4) of each link, of variables of a program."""
    for own in x.reshape(-1, _SIZE):
        X = np.empty((4, 4), dtype=object)
        X[_LOWER4] = own
        X.T[_LOWER4] = own
        yield X


def _nearest(x: Array, N: Array) -> Array:
    """Returns the unknowns of least log-det divergence, by Newton's method.

    The divergence is self-concordant: damped steps of 1 / (1 + decrement) stay physical
    and converge (Boyd and Vandenberghe 2004, "Convex optimization", 9.6).

    Args:
        x: physical, with the base parameters.
        N: (unknowns, k) the directions that keep these.
    """
    basis = _matrices(np.eye(_SIZE).reshape(-1))
    for _ in range(_NEWTON_STEPS):
        blocks, gradients = [], []
        for X in _matrices(x):
            inverse = np.linalg.inv(X)
            gradients.append(np.einsum("kij,ji->k", basis, np.eye(4) - inverse))
            turned = inverse @ basis
            blocks.append(np.einsum("aij,bji->ab", turned, turned))
        gradient = N.T @ np.concatenate(gradients)
        step = -np.linalg.solve(N.T @ block_diag(*blocks) @ N, gradient)
        decrement = np.sqrt(max(0.0, -gradient @ step))
        x = x + N @ step / (1.0 + decrement * (decrement > _FULL_STEP))
        if decrement < _CONVERGED:
            break
    return x


def _scaled(A: Array, b: Array) -> tuple[Array, Array]:
    """Returns equations A x = b whose rows have the length of one."""
    size = np.linalg.norm(A, axis=1)
    return A / size[:, None], b / size


def _is_physical(x: Array) -> bool:
    return bool(np.linalg.eigvalsh(_matrices(x)).min() > _EDGE)


def _matrices(x: Array) -> Array:
    """Returns X (links, 4, 4) of lower triangles."""
    X = np.zeros((len(x) // _SIZE, 4, 4))
    X[:, *_LOWER4] = x.reshape(-1, _SIZE)
    return X + np.tril(X, -1).swapaxes(1, 2)


def whitening(covariance: Array) -> Array:
    """Returns W (k, b) with W^T W the inverse of a covariance (b, b).

    Directions in which that is zero, since the motion determines nothing there, have no
    weight: k is the rank.
    """
    size = np.sqrt(np.maximum(np.diagonal(covariance), 1e-300))
    values, axes = np.linalg.eigh(covariance / np.outer(size, size))
    kept = values > _UNDETERMINED * values.max()
    return np.asarray((axes[:, kept] / np.sqrt(values[kept])).T / size)


def _to_inertial(L: Array) -> Array:
    """Returns what INERTIAL (10,) is by the lower triangle (10,) of X, P = L X L^T."""
    columns = []
    for i, j in zip(*_LOWER4, strict=True):
        X = np.zeros((4, 4))
        X[i, j] = X[j, i] = 1.0
        columns.append(inertial_of(L @ X @ L.T))
    return np.stack(columns, axis=1)


def pseudo_inertia(inertial: Array) -> Array:
    """Returns P (4, 4) of INERTIAL (10,)."""
    I = np.zeros((3, 3))  # noqa: E741
    I[_UPPER] = inertial[4:]
    I = I + np.triu(I, 1).T  # noqa: E741
    P = np.empty((4, 4))
    P[:3, :3] = 0.5 * np.trace(I) * np.eye(3) - I
    P[:3, 3] = P[3, :3] = inertial[1:4]
    P[3, 3] = inertial[0]
    return P


def inertial_of(P: Array) -> Array:
    """Returns INERTIAL (10,) of a pseudo-inertia (4, 4); the inverse."""
    second = P[:3, :3]
    I = np.trace(second) * np.eye(3) - second  # noqa: E741
    return np.concatenate([[P[3, 3]], P[:3, 3], I[_UPPER]])


def ball(mass: float, centre: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """Returns INERTIAL (10,) of an aluminium ball.

    Args:
        mass: of it [kg].
        centre: in B [m].
    """
    radius = np.cbrt(3.0 * mass / (4.0 * np.pi * _DENSITY))
    c = np.asarray(centre)
    P = np.empty((4, 4))
    P[:3, :3] = mass * (np.outer(c, c) + radius**2 / 5.0 * np.eye(3))
    P[:3, 3] = P[3, :3] = mass * c
    P[3, 3] = mass
    return inertial_of(P)


def _root(inertial: Array) -> Array:
    """Returns L (4, 4) with L L^T the pseudo-inertia of a nominal body.

    Of one that is not physical: of the nearest that is.
    """
    m, c = inertial[0], inertial[1:4] / inertial[0]
    second = pseudo_inertia(inertial)[:3, :3] - m * np.outer(c, c)
    values, axes = np.linalg.eigh(second)
    floor = max(_THINNEST * values.max(), pseudo_inertia(ball(m))[0, 0] * _THINNEST)
    second = (axes * np.maximum(values, floor)) @ axes.T
    P = np.empty((4, 4))
    P[:3, :3] = second + m * np.outer(c, c)
    P[:3, 3] = P[3, :3] = m * c
    P[3, 3] = m
    return np.asarray(np.linalg.cholesky(P))
