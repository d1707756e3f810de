"""A log's residual and its derivatives by all candidate effects, for simple selectors.

The model is fitted without effects, and linearised there with each candidate at null:
y is about B b + X c, with B the derivatives by the model's own parameters, and X those
by the candidates' amplitudes, in SI units.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import Effect, registered_effects
from drake_disasm.logs import read_logs
from selection.answer import Answer, Case
from sysid.fitting.candidates import (
    Candidate,
    candidates,
    extended,
    joint_groups,
)
from sysid.identification.gauss_newton import gauss_newton
from sysid.identification.linearisation import extend
from sysid.identification.noise import with_estimated_noise
from sysid.models.base import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.objective import Objective
from sysid.parameters import nominal_values
from sysid.workers import Workers

Array = NDArray[np.float64]

ROWS = 1500  # about; more are thinned out evenly
FOLDS = 10  # contiguous blocks, for held-out errors
_SHOWS = 1e-9  # of a column, that is left without the model's own parameters


@dataclasses.dataclass(frozen=True)
class Option:
    """What a selector may add: an effect, or one kind of effect at all joints.

    Attributes:
        candidates: the effects.
        columns: (k,) which columns of X are theirs.
    """

    candidates: tuple[Candidate, ...]
    columns: NDArray[np.int64]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects."""
        return tuple(c.name for c in self.candidates)


@dataclasses.dataclass(frozen=True)
class Columns:
    """A linearised log.

    Attributes:
        case: which it is of.
        model: of the log, without effects.
        theta: (p,) its fitted parameters.
        y: (rows, channels) measured less the fit without effects, SI.
        base: (rows, channels, p) derivatives by the model's own parameters.
        X: (rows, channels, k) derivatives by candidates' amplitudes.
        owners: (k,) of each column, the candidate with that amplitude alone.
        options: what may be added.
    """

    case: Case
    model: LogModel
    theta: Array
    y: Array
    base: Array
    X: Array
    owners: tuple[Candidate, ...]
    options: tuple[Option, ...]

    @classmethod
    def of(cls, case: Case, rows: int = ROWS) -> "Columns":
        """Returns the columns of a case's log, thinned to about so many rows."""
        model = _model(case.logs, rows)
        chosen = candidates(model, _library(case))
        fitted = Objective(model, huber_delta=np.inf)
        fit = gauss_newton(fitted, fitted.start, central=model.affine)
        longer, groups = extended(model, chosen)
        wide, own = Objective(longer, huber_delta=np.inf), len(model.parameters)
        nulls = nominal_values(longer.parameters[own:])
        theta = np.append(fitted.scaling.from_unit(fit.u), nulls)
        found = extend(fit, wide, wide.scaling.to_unit(theta))
        sigma = np.broadcast_to(model.measurements.sigma, fit.residual.shape)
        J = found.jacobian / wide.scaling.slope(theta) * sigma[..., None]
        return cls(
            case,
            model,
            theta[:own],
            -fit.residual * sigma,
            J[..., :own],
            J[..., own:],
            _owners(longer, chosen, groups),
            _options(chosen, [np.array(g, dtype=np.int64) - own for g in groups]),
        )

    @property
    def fields(self) -> tuple[str, ...]:
        """Names (k,) of the columns: "name.field"."""
        return tuple(f"{c.name}.{c.fields[0]}" for c in self.owners)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.y)

    def scaled(self, weight: Array) -> tuple[Array, Array, Array]:
        """Returns y, B and X, each channel divided by a weight (channels,).

        As (rows * channels,), (rows * channels, p) and (rows * channels, k).
        """
        w = weight[:, None]
        flat = len(weight) * self.rows
        parts = (self.y / weight, self.base / w, self.X / w)
        y, B, X = (part.reshape(flat, -1) for part in parts)
        return y[:, 0], B, X

    def blocks(self, count: int) -> NDArray[np.int64]:
        """Returns the number of the contiguous block (rows,) of each row."""
        return np.arange(self.rows) * count // self.rows

    def weight(self, chosen: Sequence[int]) -> Array:
        """Returns the rms (channels,) of what a fit with some columns leaves, SI."""
        spread = np.maximum(np.sqrt(np.mean(self.y**2, axis=0)), 1e-12)
        y, B, X = self.scaled(spread)
        A = np.hstack([B, X[:, list(chosen)]])
        left = (y - A @ solved(A, y)).reshape(self.y.shape) * spread
        return np.maximum(np.sqrt(np.mean(left**2, axis=0)), 1e-9 * spread)

    def held_out_residual(self, chosen: Sequence[int], weight: Array) -> Array:
        """Returns residuals (rows, channels) of blocks by fits to all others."""
        y, B, X = self.scaled(weight)
        A = np.hstack([B, X[:, list(chosen)]])
        block = np.repeat(self.blocks(FOLDS), self.y.shape[1])
        left = np.empty_like(y)
        for number in range(FOLDS):
            own = block == number
            left[own] = y[own] - A[own] @ solved(A[~own], y[~own])
        return left.reshape(self.y.shape)

    def solution(self, chosen: Sequence[int], weight: Array) -> Array:
        """Returns least-squares changes of own parameters and of chosen amplitudes."""
        y, B, X = self.scaled(weight)
        return solved(np.hstack([B, X[:, list(chosen)]]), y)

    def held_out_error(self, chosen: Sequence[int]) -> float:
        """Returns the relative held-out error with some columns.

        Of the case's other recording, or of contiguous blocks if it has none.
        """
        weight = self.weight(chosen)
        if not self.case.held_out:
            left = self.held_out_residual(chosen, weight) * weight
            return _relative(left, self.model.measurements.values)
        other = _model(self.case.held_out, ROWS)
        effects = [self.owners[c] for c in chosen]
        found = self.solution(chosen, weight)
        found[: len(self.theta)] += self.theta
        predicted = extended(other, effects)[0].predictions(found)
        measured = other.measurements.values
        return _relative(predicted - measured, measured)

    def answer(
        self,
        ending: str,
        chosen: Sequence[Option],
        confirmed: Sequence[str],
        ambiguous: dict[str, tuple[str, ...]],
        sizes: dict[str, tuple[float, float, float]],
    ) -> Answer:
        """Returns an answer with the held-out errors.

        Args:
            ending: of the answer.
            chosen: options in the model; names that are not confirmed are suggested.
            confirmed: names.
            ambiguous: rivals of names.
            sizes: values and intervals.
        """
        columns = columns_of(chosen)
        names = dict.fromkeys(n for option in chosen for n in option.names)
        return Answer(
            ending,
            tuple(dict.fromkeys(confirmed)),
            tuple(n for n in names if n not in confirmed),
            ambiguous,
            sizes,
            self.held_out_error([]),
            self.held_out_error(columns),
        )


def columns_of(options: Sequence[Option]) -> list[int]:
    """Returns the columns of options, each once."""
    return list(dict.fromkeys(int(c) for o in options for c in o.columns))


def without_base(columns: Array, base: Array) -> Array:
    """Returns columns (n, k) less what others (n, p) can take up."""
    if not base.shape[1]:
        return columns
    scale = np.maximum(np.linalg.norm(base, axis=0), 1e-300)
    left, values, _ = np.linalg.svd(base / scale, full_matrices=False)
    basis = left[:, values > 1e-9 * max(values[0], 1e-300)]
    return np.asarray(columns - basis @ (basis.T @ columns))


def gain_of(columns: Array, residual: Array, size: Array) -> float:
    """Returns the share of a residual's squares (n,) that columns (n, k) take away.

    Args:
        columns: with what is in the fit already projected out.
        residual: of the fit.
        size: (k,) norms of the columns before that.
    """
    shown = np.linalg.norm(columns, axis=0) > _SHOWS**0.5 * size
    if not shown.any():
        return 0.0
    own = columns[:, shown]
    G, b = own.T @ own, own.T @ residual
    scale = np.sqrt(np.diagonal(G))
    found = np.linalg.lstsq(G / np.outer(scale, scale), b / scale, rcond=_SHOWS)[0]
    return float(found @ (b / scale) / max(residual @ residual, 1e-300))


def solved(A: Array, y: Array) -> Array:
    """Returns the least-squares solution (k,); null in directions A does not fix."""
    scale = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(A / scale, y, rcond=_SHOWS)[0] / scale)


def _model(folders: Sequence[str], rows: int) -> LogModel:
    """Returns the model of logs, its noise estimated, of about so many rows."""
    logs = read_logs([Path(folder) for folder in folders])
    model = model_of(logs, ModelChoice(fixed=True))
    model = with_estimated_noise(model, Workers(), np.inf)
    return model.thin(max(1, round(model.measurements.rows / rows)))


def _library(case: Case) -> list[type[Effect]]:
    return [e for e in registered_effects() if e.__name__ not in case.left_out]


def _owners(
    longer: LogModel, chosen: Sequence[Candidate], groups: Sequence[range]
) -> tuple[Candidate, ...]:
    """Returns of each new parameter the candidate with that amplitude alone."""
    return tuple(
        candidate.only([longer.parameters[i].name.rpartition(".")[2]])
        for candidate, own in zip(chosen, groups, strict=True)
        for i in own
    )


def _options(
    chosen: Sequence[Candidate], groups: Sequence[NDArray[np.int64]]
) -> tuple[Option, ...]:
    """Returns each candidate, and each kind at all joints, as an option.

    But for those whose amplitudes are the model's own parameters.
    """
    columns = {c.text: own for c, own in zip(chosen, groups, strict=True) if len(own)}
    new = [c for c in chosen if c.text in columns]
    sets = [*((c,) for c in new), *joint_groups(new)]
    return tuple(
        Option(own, np.concatenate([columns[c.text] for c in own])) for own in sets
    )


def _relative(error: Array, measured: Array) -> float:
    return float(np.linalg.norm(error) / np.linalg.norm(measured))
