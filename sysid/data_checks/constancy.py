"""Channels that never change, repeat a value, or come in coarse steps."""

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs.importing.repeats import held_of, held_rows, is_saturated
from sysid.data_checks.expectation import Expectation, FittedExpectation
from sysid.data_checks.finding import DataFinding, Severity, rows_of
from sysid.data_checks.settings import DEFAULT_DATA_SETTINGS, DataSettings
from sysid.data_checks.subject import Subject
from sysid.models.base import Array, LogModel, PredictionError
from sysid.parameters import nominal_values

_QUANTITIES = ("wrench", "ft_sensor", "tau")
_ROUNDED = 1e-9  # of the forces' range: what turning there and back leaves
_ROUNDING = 1e-3  # of a step: how near to whole ones differences are
_MANY = 3  # different values, of which steps can be told


def dead_channels(
    model: LogModel, settings: DataSettings = DEFAULT_DATA_SETTINGS
) -> list[DataFinding]:
    """Finds channels that never change where the model expects them to.

    A model that is affine is first fitted to all other channels: what the sensor
    carries may be known by these alone.
    """
    if model.measurements.rows < settings.dead_channel_rows:
        return []
    dead = _dead(model, settings)
    dead = dead or _dead_in_table(model, settings)
    if not dead:
        return []
    what = (
        f"the log is constant in {', '.join(dead)} over all {model.measurements.rows} "
        "rows: is the sensor alive?"
    )
    remedy = "record it anew; if it was imported, look at the channels in the map"
    return [DataFinding("constant", what, remedy, Severity.REFUSE)]


def _dead(model: LogModel, settings: DataSettings) -> list[str]:
    """Returns the channels that never change and should, in words."""
    measured = model.measurements
    still = np.ptp(measured.values, axis=0) == 0.0
    if not still.any():
        return []
    change, noise = _expected_change(model, ~still, settings)
    moves = change > settings.dead_channel_change * noise
    return [
        f"{channel.name}{_by(by, channel.unit)}"
        for channel, by, bad in zip(
            measured.channels, change, still & moves, strict=True
        )
        if bad
    ]


def _dead_in_table(model: LogModel, settings: DataSettings) -> list[str]:
    """Returns the columns of the processed wrench that never change and should."""
    measured = model.measurements
    table, *others = model.frames(np.arange(measured.rows))
    if not others or model.affine:
        return []
    still = np.ptp(table.of(measured.values), axis=0) < _ROUNDED * np.ptp(
        measured.values[:, 6:9]
    )
    if not still[6:].any():
        return []
    change = np.ptp(table.of(_nominal(model)), axis=0)
    noise = np.repeat([measured.noise[6:9].max(), measured.noise[9:].max()], 3)
    moves = change[6:] > settings.dead_channel_change * noise
    columns = zip(measured.channels[6:], change[6:], still[6:] & moves, strict=True)
    return [f"wrench.{c.name}{_by(by, c.unit)}" for c, by, bad in columns if bad]


def _nominal(model: LogModel) -> Array:
    """Returns what the nominal model expects (rows, channels); zero where it fails."""
    try:
        return model.predictions(nominal_values(model.parameters))
    except PredictionError:
        return np.zeros_like(model.measurements.values)


def _expected_change(
    model: LogModel, live: NDArray[np.bool_], settings: DataSettings
) -> tuple[Array, Array]:
    """Returns by how much each channel (channels,) should change, and its noise."""
    measured = model.measurements
    change = np.ptp(_nominal(model), axis=0)
    if not model.affine:
        return change, measured.noise
    fit = FittedExpectation(model, settings, live)
    change = np.maximum(change, np.ptp(fit.fitted(), axis=0))
    units = np.array([channel.unit for channel in measured.channels])
    of_unit = {u: fit.scale[live & (units == u)] for u in np.unique(units)}
    known = [len(of_unit[u]) > 0 for u in units]
    # Whatever is carried or moved, not all forces, nor all torques, stay the same.
    change = np.where(known, change, np.inf)
    noise = [np.median(of_unit[u]) if len(of_unit[u]) else 0.0 for u in units]
    return change, np.array(noise)


def _by(change: float, unit: str) -> str:
    """Returns what is expected of a channel, in words; nothing if that is not known."""
    if np.isinf(change):
        return ""
    return f" (the model expects it to change by {change:.2g} {unit})"


def stuck_findings(subject: Subject) -> list[DataFinding]:
    """Finds rows over which a force, torque or reading repeats one value.

    By what an import has seen in the rows as recorded, or by the log itself.
    """
    found = []
    for name in _columns(subject):
        masks, at_end = _recorded_repeats(subject, name) or _repeats(subject, name)
        rows = rows_of(masks)
        if not rows:
            continue
        what = f"{name} repeats {'its end value' if at_end else 'a value'}: "
        what += "is it saturated?" if at_end else "did the sensor stop?"
        remedy = "record it anew, or leave the rows out: `drop_flagged_rows`"
        found.append(DataFinding("stuck", what, remedy, rows=rows))
    return found


_Masks = dict[str, NDArray[np.bool_]]


def _recorded_repeats(subject: Subject, name: str) -> tuple[_Masks, bool] | None:
    """Returns masks (rows,) by the episode, and whether all of it is an end value."""
    masks, at_end = {}, []
    for (episode, table), log in zip(subject.named(), subject.log_of, strict=True):
        held = held_of(log.header.provenance, table.name, name)
        masks[episode] = np.zeros(table.rows, dtype=bool)
        for part in held:
            at_end.append(part.at_end)
            masks[episode] |= (table["time"] >= part.begin) & (
                table["time"] <= part.end
            )
    return (masks, all(at_end)) if at_end else None


def _repeats(subject: Subject, name: str) -> tuple[_Masks, bool]:
    """Returns the same of rows that repeat a value in the log."""
    names, columns = zip(
        *((n, e.columns[name]) for n, e in subject.named()), strict=True
    )
    settings, values = subject.settings, np.concatenate(columns)
    masks = held_rows(columns, settings.stuck_rows, settings.stuck_share)
    at_end = is_saturated(values, np.concatenate(masks))
    return dict(zip(names, masks, strict=True)), at_end


def quantum_findings(subject: Subject, expected: Expectation) -> list[DataFinding]:
    """Finds columns that come in steps coarser than the noise, and than is declared."""
    noise = _noise_by_column(subject, expected)
    found = []
    for name in _columns(subject):
        step = _step(subject.column(name))
        if step > subject.settings.quantum_noise * noise.get(name, np.inf):
            what = f"{name} comes in steps of {step:.3g}, coarser than its noise"
            remedy = "declare it (ft_sensor.quantum), or log more digits"
            found.append(DataFinding("quantum", what, remedy))
    return found


def _noise_by_column(subject: Subject, expected: Expectation) -> dict[str, float]:
    """Returns what steps of the columns are compared with, by column."""
    measured = subject.model.measurements
    names = [channel.name for channel in measured.channels]
    if subject.is_of_joints:
        scales = expected.scale.tolist()
        return dict(zip(subject.column_names, scales, strict=True))
    noise = dict(zip(names, expected.scale.tolist(), strict=True))
    columns = _columns(subject)
    declared = subject.declared_quantum
    return {
        name: max(noise[name.split(".")[1]], declared.get(name.split(".")[1], 0.0))
        for name in columns
    }


def _step(values: Array) -> float:
    """Returns the step of which all differences of values (n,) are multiples, or 0."""
    different = np.unique(values)
    steps = np.diff(different)
    if len(different) < _MANY or 2 * len(different) > len(values):
        return 0.0
    least = float(steps[steps > _ROUNDING * np.median(steps)].min())
    multiples = steps / least
    off = np.abs(multiples - np.round(multiples))
    return least if float(off.max()) < _ROUNDING else 0.0


def _columns(subject: Subject) -> list[str]:
    """Returns the columns that sensors measure, of those that the log has."""
    first = subject.episodes[0]
    return [name for q in _QUANTITIES for name in first.components(q)]
