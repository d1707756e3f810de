"""Whether `wrench` is `ft_sensor` processed: turned, shifted, without the payload."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.cell.tool import Tool
from drake_disasm.logs import Episode
from drake_disasm.logs.schema import WRENCH
from drake_disasm.logs.transitions import observations
from sysid.data_checks.finding import DataFinding, Severity, rows_of
from sysid.data_checks.settings import DataSettings
from sysid.data_checks.subject import Subject
from sysid.models.base import Array
from sysid.models.sensor_reading import SensorReading, at_sensor
from sysid.parameters import nominal_values

_RAW = "it is the raw reading, neither turned into G nor shifted to Bo"
_SAME = 1e-6  # of the range: numbers that were copied


def processing_findings(subject: Subject) -> list[DataFinding]:
    """Finds rows in which `wrench` and `ft_sensor` contradict each other.

    Brought back to the sensor, and with the weight of what hangs on it, the processed
    wrench differs from the raw reading by the zero of the episode, which is constant
    (`contact_wrench`). What hangs on it is what the twin's sensor carries, or the
    cell's: that which agrees better is taken.
    """
    model = subject.model
    scenario = model.scenario_at(nominal_values(model.parameters))
    if subject.kind != "transitions" or scenario is None:
        return []
    tool = Tool.from_models(scenario)
    stations = [SensorReading(scenario, tool, name) for name in ("twin", "cell")]
    errors = [_errors(subject, reading) for reading in stations]
    error = min(errors, key=lambda parts: float(np.median(np.concatenate(parts))))
    names = [name for name, _ in subject.named()]
    masks = {name: part > 1.0 for name, part in zip(names, error, strict=True)}
    share = float(np.mean(np.concatenate(list(masks.values()))))
    if not share:
        return []
    what = f"wrench is not what ft_sensor processed gives in {100 * share:.2g} % of the"
    what += f" rows{_reason(subject)}"
    remedy = (
        "process the raw reading as docs/reference/log-format.md says, or leave the "
        "rows out: `drop_flagged_rows`"
    )
    severity = Severity.REFUSE if _RAW in what else Severity.WARN
    return [DataFinding("processing", what, remedy, severity, rows_of(masks))]


def _errors(subject: Subject, reading: SensorReading) -> list[Array]:
    """Returns each episode's contradiction (rows,), in units of what is tolerated."""
    settings, noise = subject.settings, subject.model.measurements.noise[6:]
    zeros = [_zero(episode, reading) for episode in subject.episodes]
    raw = [episode["ft_sensor"] for episode in subject.episodes]
    tolerated = _tolerated(raw, noise, settings)
    return [
        np.abs((zero - np.median(zero, axis=0)) / tolerated).max(axis=1)
        for zero in zeros
    ]


def _tolerated(raw: Sequence[Array], noise: Array, settings: DataSettings) -> Array:
    """Returns by how much each channel (6,) may differ; axes of a kind together."""
    change = np.ptp(np.concatenate(raw), axis=0)
    most = np.repeat([change[:3].max(), change[3:].max()], 3)
    return np.maximum(
        settings.processing_noise * noise, settings.processing_share * most
    )


def _zero(episode: Episode, reading: SensorReading) -> Array:
    """Returns the zero (rows, 6) of the sensor that each row implies."""
    states = at_sensor(observations(episode), reading.mounting)
    weight = reading.payload.weight(reading.orientations(states))
    return np.asarray(episode["ft_sensor"] - states[:, 6:] - weight)


def _reason(subject: Subject) -> str:
    """Returns what may be the reason, in words; empty if none is apparent."""
    first = subject.episodes[0]
    wrench, raw = (
        np.concatenate([e[name] for e in subject.episodes])
        for name in ("wrench", "ft_sensor")
    )
    still = _names(np.ptp(wrench, axis=0) == 0.0, "wrench")
    still += _names(np.ptp(raw, axis=0) == 0.0, "ft_sensor")
    if still:
        return f": {', '.join(still)} {'is' if len(still) == 1 else 'are'} constant"
    turned, plain = (w - np.median(w, axis=0) for w in (wrench, raw))
    if np.abs(turned - plain).max() < _SAME * np.ptp(raw):
        return f": {_RAW}"
    shift = _shift_of(first, subject)
    if shift:
        late = "late" if shift > 0 else "early"
        return f": wrench is {late} by {abs(shift)} row{'s' * (abs(shift) > 1)}"
    return ""


def _names(mask: NDArray[np.bool_], quantity: str) -> list[str]:
    return [f"{quantity}.{name}" for name, it in zip(WRENCH, mask, strict=True) if it]


def _shift_of(episode: Episode, subject: Subject) -> int:
    """Returns by how many rows the wrench of an episode is late, if that explains it.

    By the size of the force, which no turn changes: zeroed at the first row, of both.
    """
    most = subject.settings.most_shift
    force = np.linalg.norm(episode["wrench"][:, :3], axis=1)
    raw = np.linalg.norm(
        episode["ft_sensor"][:, :3] - episode["ft_sensor"][0, :3], axis=1
    )
    if len(force) <= 4 * most:
        return 0
    inner = slice(most, len(force) - most)
    errors = {
        shift: float(np.mean(np.abs(np.roll(force, -shift) - raw)[inner]))
        for shift in range(-most, most + 1)
    }
    best = min(errors, key=lambda shift: errors[shift])
    return best if errors[best] < subject.settings.explained * errors[0] else 0
