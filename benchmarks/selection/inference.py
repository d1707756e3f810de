"""Intervals that allow for correlation, and ambiguous sets, for simple selectors."""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from selection.columns import Array, Columns, Option, columns_of, solved, without_base

_NU, _MOST_NU = 0.41, 32  # cosines: 0.41 n^(2/3), at most 32


def ambiguous(
    found: Sequence[tuple[Option, Sequence[Option]]],
) -> dict[str, tuple[str, ...]]:
    """Returns the rivals of each name: of one at several joints those at its own."""
    sets: dict[str, tuple[str, ...]] = {}
    for option, rivals in found:
        for name in option.names:
            joint = name.partition(".")[2]
            others = [
                n
                for rival in rivals
                for n in rival.names
                if n not in option.names
                if len(option.names) == 1 or n.endswith(f".{joint}")
            ]
            if others:
                sets[name] = tuple(dict.fromkeys((*sets.get(name, ()), *others)))
    return sets


def intervals(
    columns: Columns, options: Sequence[Option]
) -> dict[str, tuple[float, float, float]]:
    """Returns value and 95 % interval of each option's amplitudes, by name."""
    chosen = columns_of(options)
    if not chosen:
        return {}
    weight = columns.weight(chosen)
    y, B, X = columns.scaled(weight)
    own = without_base(X[:, chosen], B)
    found = solved(own, without_base(y[:, None], B)[:, 0])
    residual = without_base(y[:, None], np.hstack([B, X[:, chosen]]))[:, 0]
    covariance, nu = covariance_of(columns, own, residual)
    reach = stats.t.ppf(0.975, nu) * np.sqrt(np.diagonal(covariance))
    rows = zip(chosen, found, reach, strict=True)
    return {
        columns.fields[c]: (float(v), float(v - r), float(v + r)) for c, v, r in rows
    }


def covariance_of(columns: Columns, own: Array, residual: Array) -> tuple[Array, int]:
    """Returns the covariance (k, k) of coefficients, and its degrees of freedom.

    Of the influence series psi_t = sum over channels of x e, projected on cosines.
    """
    rows, k = columns.rows, own.shape[1]
    psi = (own * residual[:, None]).reshape(rows, -1, k).sum(axis=1)
    nu = max(1, min(int(_NU * rows ** (2.0 / 3.0)), _MOST_NU))
    at = (np.arange(rows) + 0.5) / rows
    waves = np.sqrt(2.0) * np.cos(np.pi * np.outer(np.arange(1, nu + 1), at))
    parts = waves @ psi
    bread = np.linalg.pinv(own.T @ own, hermitian=True)
    return bread @ (parts.T @ parts / nu) @ bread, nu
