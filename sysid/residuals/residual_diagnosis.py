"""Describes a residual, channel by channel, whatever explains it."""

from dataclasses import dataclass

import numpy as np

from sysid.fitting.fit import Fit
from sysid.identification.whiteness import ljung_box


@dataclass(frozen=True)
class ChannelDiagnosis:
    """One channel's residual.

    Attributes:
        channel, unit: which.
        rms: in units of the channel's noise.
        whiteness: p-value of Ljung and Box's test that it is white.
        between_episodes: share of its power that lies in the episodes' means; 0 if
            there is one episode.
    """

    channel: str
    unit: str
    rms: float
    whiteness: float
    between_episodes: float


def diagnose(fit: Fit) -> list[ChannelDiagnosis]:
    """Returns the diagnosis of each channel at a fit."""
    measured, residual = fit.model.measurements, fit.linearisation.residual
    found = []
    for i, channel in enumerate(measured.channels):
        found.append(
            ChannelDiagnosis(
                channel.name,
                channel.unit,
                float(np.sqrt(np.mean(residual[:, i] ** 2))),
                ljung_box(residual[:, i]),
                _between(residual[:, i], measured.episode),
            )
        )
    return found


def _between(residual: np.ndarray, episode: np.ndarray) -> float:
    """Returns the share of power in the means of episodes."""
    count = int(episode.max()) + 1
    power = float(np.sum(residual**2))
    if count < 2 or power == 0.0:
        return 0.0
    rows = np.bincount(episode)
    means = np.bincount(episode, residual) / rows
    return float(np.sum(rows * means**2) / power)
