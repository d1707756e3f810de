"""Linear systems of made-up columns, of effects in name only."""

from collections.abc import Mapping, Sequence

import numpy as np

from drake_disasm.effects import JointCoulombFriction, SensorDrift
from sysid.effect_selection.forward_selection import Selection, Term, select
from sysid.effect_selection.linear_account import LinearAccount
from sysid.effect_selection.linear_system import LinearSystem
from sysid.effect_selection.replication import (
    Standing,
    standings,
    votes_of_selections,
)
from sysid.fitting.block_grams import BlockGrams, blocks_of
from sysid.fitting.candidates import Candidate
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.parameters import Parameter

FREE = (-np.inf, np.inf)  # bounds of a coefficient
TIME = "time"  # a joint's name that stands for SensorDrift


def of_joint(joint: str) -> Candidate:
    """Returns an effect at a joint; of TIME, one of time alone."""
    if joint == TIME:
        return Candidate.of(SensorDrift())
    return Candidate.of(JointCoulombFriction(joint=joint))


def linear_system(
    columns: Mapping[str, np.ndarray],
    residual: np.ndarray,
    *,
    episode: np.ndarray | None = None,
    bounds: Sequence[tuple[float, float]] = (),
    noise_is_stated: bool = False,
) -> LinearSystem:
    """Returns the system of candidates' columns beside a base of an offset.

    Args:
        columns: (rows, k) of each candidate, by its joint.
        residual: (rows,).
        episode: (rows,) number of each row's episode; one if left out.
        bounds: of each column's coefficient, the base first; none if left out.
        noise_is_stated: whether residuals are in units of their noise.
    """
    rows = len(residual)
    each = [np.ones((rows, 1)), *columns.values()]
    ends = np.cumsum([own.shape[1] for own in each])
    episode = np.zeros(rows, dtype=np.int64) if episode is None else episode
    grams = BlockGrams.of(
        [own[:, None, :] for own in each],
        residual[:, None],
        np.ones((rows, 1)),
        blocks_of(episode, DEFAULT_SETTINGS.blocks),
        episode,
        np.array(bounds or [FREE] * ends[-1]),
    )
    terms = tuple(
        Term((of_joint(joint),), np.arange(begin, end), np.zeros(end - begin, np.int64))
        for joint, begin, end in zip(columns, ends[:-1], ends[1:], strict=True)
    )
    parameters = tuple(
        Parameter(f"x.{i}", 0.0, -5.0, 5.0, "N") for i in range(ends[-1])
    )
    return LinearSystem(
        grams, np.arange(1), terms, (0,), noise_is_stated, parameters, None, (),
        DEFAULT_SETTINGS,
    )  # fmt: skip


def selected(system: LinearSystem) -> Selection:
    """Returns the effects that lower the held-out loss."""
    return select(
        system.grams, system.own, system.terms, system.settings, system.weights
    )


def placed(system: LinearSystem, recordings: int = 1) -> dict[str, Standing]:
    """Returns where each effect of the selection stands, by its name."""
    found = selected(system)
    votes, _ = votes_of_selections(system, lambda done, count: None, np.inf)
    effects = [candidate for term in found.terms for candidate in term.candidates]
    account = LinearAccount.of_selection(system, found, found.names)
    each = standings(account, votes, {}, effects, recordings)
    return {standing.name: standing for standing in each}
