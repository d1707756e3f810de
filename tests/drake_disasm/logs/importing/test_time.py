"""Times of recordings: rates, orders, coarse clocks, late stamps, several files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.logs.importing import (
    ImportProcessing,
    Known,
    guessed_map,
    import_recordings,
    read_map,
    read_source,
)
from drake_disasm.logs.importing.field_map import FieldMap, parse_map
from drake_disasm.logs.importing.joining import joined
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.stamps import evened
from tests.refusals import refusal

_Q = {"kind": "joint_motion", "joints": ["a"], "columns": {"q": "q"}}


def _source(path: Path, **arrays: Any) -> Source:
    np.savez(path, **arrays)
    return read_source(path)


def _imported(source: Source, fields: FieldMap, **options: Any) -> Any:
    return import_recordings([source], fields, ImportProcessing(cutoff=5.0), **options)


def test_a_rate_stands_in_for_times(tmp_path: Path) -> None:
    time = 0.01 * np.arange(600)
    source = _source(tmp_path / "run.npz", q=np.sin(time))
    assert "give the rows a second" in refusal(guessed_map, source, "joint_motion")
    guess = guessed_map(source, "joint_motion", Known(rate=100.0))
    fields = parse_map(_Q | {"time": {"rate": 100}})
    (tmp_path / "map.yaml").write_text(fields.to_yaml())
    assert read_map(tmp_path / "map.yaml") == fields
    for each in (guess, fields):
        [episode] = _imported(source, each).episodes
        v = episode["v"][:, 0]
        assert np.abs(v).max() == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"time": {"rate": 0}}, "time.rate 0 is not above zero"),
        ({"time": {"rate": -1.0}}, "is not above zero"),
        ({"time": {"rate": 10, "from": "t"}}, "a rate and a channel"),
        ({"time": {"rate": "fast"}}, "fast is no number"),
        ({"order": {"from": "n"}}, "needs times, not an order"),
        ({"order": "n", "time": {"from": "t"}}, "has time and order"),
    ],
)
def test_a_wrong_time_is_refused(changes: dict[str, Any], said: str) -> None:
    assert said in refusal(parse_map, _Q | changes)


def test_readings_at_rest_may_have_an_order(tmp_path: Path) -> None:
    names = ("qw", "qx", "qy", "qz", "fx", "fy", "fz", "tx", "ty", "tz")
    table = np.random.default_rng(0).random((10, 9))
    table[:4] /= np.linalg.norm(table[:4], axis=0)
    columns = dict(zip(names, table, strict=True))
    source = _source(tmp_path / "a.npz", order=2.0 * np.arange(9), **columns)
    fields = guessed_map(source, "static_wrench")
    [episode] = import_recordings([source], fields, ImportProcessing()).episodes
    np.testing.assert_array_equal(episode["order"], 2.0 * np.arange(9))
    np.testing.assert_array_equal(episode["wrench"], table[4:].T)
    assert parse_map({"kind": "static_wrench", "columns": {"order": "n"}}).time == "n"
    source = _source(tmp_path / "b.npz", **columns)  # that of the rows
    fields = guessed_map(source, "static_wrench")
    (tmp_path / "map.yaml").write_text(fields.to_yaml())
    fields = read_map(tmp_path / "map.yaml")
    [episode] = import_recordings([source], fields, ImportProcessing()).episodes
    np.testing.assert_array_equal(episode["order"], np.arange(9.0))


def test_a_coarse_clock_is_refused_with_its_rate(tmp_path: Path) -> None:
    time = 100.3 + np.arange(1000) / 125.0
    fields = parse_map(_Q | {"time": {"from": "t"}})
    for step in (1.0, 0.01):
        coarse = np.floor(time / step) * step
        source = _source(tmp_path / "run.npz", t=coarse, q=np.sin(time))
        message = refusal(_imported, source, fields)
        assert f"has steps of {step:g} s with" in message
        rate = float(message.rpartition(" ")[2])
        assert rate == pytest.approx(125.0, rel=2e-3)


def test_more_than_a_tenth_of_the_rows_is_not_left_out(tmp_path: Path) -> None:
    time = 0.01 * np.arange(1000)
    q = np.sin(time)
    q[:120] = np.nan
    source = _source(tmp_path / "run.npz", t=time, q=q)
    fields = parse_map(_Q | {"time": {"from": "t"}})
    message = refusal(_imported, source, fields)
    assert "of 1000 rows would be left out: 120 without numbers" in message
    found = _imported(source, fields, accept=True)
    assert found.dropped == {"without numbers": 120}


def _late(delay: float, lost: float, of_sampling: bool) -> tuple[np.ndarray, ...]:
    """Returns true times, stamps and positions of two joints at 500 Hz."""
    random = np.random.default_rng(3)
    true = 0.002 * np.flatnonzero(random.random(6000) >= lost)
    if of_sampling:
        true = true + random.uniform(-delay, delay, len(true))
        stamps = true
    else:
        stamps = np.maximum.accumulate(true + random.gamma(1.0, delay, len(true)))
    q = np.stack([0.3 * np.sin(2.0 * np.pi * f * true + f) for f in (0.3, 0.7)], axis=1)
    return true, stamps, np.round(q / 1e-5) * 1e-5


@pytest.mark.parametrize("lost", [0.0, 0.1])
def test_stamps_of_arrival_are_made_even(lost: float) -> None:
    true, stamps, q = _late(3e-4, lost, of_sampling=False)
    found = evened(stamps, q)
    assert found is not None
    assert found.period == pytest.approx(0.002, rel=1e-4)
    assert found.lost == round((true[-1] - true[0]) / 0.002) + 1 - len(true)
    error = found.time - true
    assert np.ptp(error) < 1e-4  # no row is a period off


def test_stamps_of_sampling_are_taken_as_they_are() -> None:
    for lost in (0.0, 0.05):
        _, stamps, q = _late(8e-4, lost, of_sampling=True)
        assert evened(stamps, q) is None
    true, _, q = _late(0.0, 0.05, of_sampling=True)  # rows are missing, and that is all
    assert evened(true, q) is None
    assert evened(_late(3e-4, 0.0, False)[1], 0.0 * q[:1].repeat(6000, 0)) is None


def test_late_stamps_do_not_make_accelerations(tmp_path: Path) -> None:
    """2 ms of delay at 500 Hz, on a motion of at most 5.8 rad/s^2."""
    _, stamps, q = _late(2e-3, 0.02, of_sampling=False)
    source = _source(tmp_path / "run.npz", t=stamps, q=q[:, 1])
    fields = parse_map(_Q | {"time": {"from": "t"}})
    options = ImportProcessing(cutoff=20.0)
    found = import_recordings([source], fields, options, accept=True)
    assert "stamps are of arrival" in found.recordings[0].evened.words()
    worst = max(np.abs(each["vd"]).max() for each in found.episodes)
    kept = import_recordings([source], fields, options, accept=True, even=False)
    late = max(np.abs(each["vd"]).max() for each in kept.episodes)
    assert worst < 7.5 and late > 3.0 * worst


def test_files_are_joined_as_columns(tmp_path: Path) -> None:
    time = 0.01 * np.arange(600)
    first = _source(tmp_path / "a.npz", t=time, q=np.sin(time))
    same = _source(tmp_path / "b.npz", t=time, tau=np.cos(time))
    slow = _source(tmp_path / "c.npz", t=time[::3], tau=np.cos(time[::3]))
    for other in (same, slow):
        source = joined([first, other], "time", Known())
        tau = source.channel("tau")
        np.testing.assert_allclose(tau, np.cos(time[: len(tau)]), atol=1e-5)
        assert set(source.files) == {str(first.path), str(other.path)}
        is_said = [n.endswith("times of a, at 100 Hz") for n in source.notes]
        assert is_said == [True] * (other is slow)
    by_rows = joined([first, same], "rows", Known())
    assert by_rows.streams[0].names == ["t", "q", "b.t", "tau"]
    named = {"t": time, "elbow": np.sin(time)}
    pair = [_source(tmp_path / f"{n}.npz", **named) for n in ("position", "effort")]
    fields = guessed_map(joined(pair, "time", Known()), "joint_motion")
    assert fields.columns["tau"].channels == ("effort.elbow",)  # by its file's name
    assert "has 200 rows, a.npz 600" in refusal(joined, [first, slow], "rows", Known())
    later = _source(tmp_path / "d.npz", t=time + 100.0, tau=time)
    assert "no clock in common" in refusal(joined, [first, later], "time", Known())
    none = _source(tmp_path / "e.npz", tau=time)
    assert "called as time is, to join" in refusal(
        joined, [first, none], "time", Known()
    )
    assert "give the files" in refusal(joined, [first], "time", Known())
