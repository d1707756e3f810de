"""Values that a channel repeats, and where an import says so."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.logs import read_log
from drake_disasm.logs.importing import (
    ImportProcessing,
    guessed_map,
    import_recordings,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.description import summary
from drake_disasm.logs.importing.repeats import held_of, held_rows

TIME = 0.01 * np.arange(3000)
Q = np.sin(2.0 * TIME) + 0.3 * np.sin(5.3 * TIME)
TAU = 3.0 * np.cos(2.0 * TIME) + 0.02 * np.random.default_rng(0).standard_normal(3000)


def test_all_rows_at_an_end_value_are_held_if_it_is_repeated_for_long() -> None:
    clipped = np.clip(TAU, -2.5, np.inf)
    clipped[300] = -2.5
    [mask] = held_rows([clipped])
    np.testing.assert_array_equal(mask, clipped == -2.5)


@pytest.mark.parametrize("step", [0.2, 1.0, 100.0])
def test_a_coarse_or_constant_channel_holds_nothing(step: float) -> None:
    assert not held_rows([np.round(TAU / step)])[0].any()


def test_a_coarse_channel_at_rest_holds_nothing() -> None:
    moves = np.clip(TIME - 0.5, 0.0, 1.0) ** 2
    own = np.round(moves * (TAU - 3.0) / 0.01) * 0.01
    assert np.all(own[:50] == own[0]) and own[49] != own[80]
    assert not held_rows([own])[0].any()
    own[1500:1530] = own[1530] + 0.05
    [mask] = held_rows([own])
    np.testing.assert_array_equal(np.flatnonzero(mask), np.arange(1500, 1530))


def _log(folder: Path, **columns: np.ndarray):
    np.savez(folder / "run.npz", time=TIME, **columns)
    source = read_source(folder / "run.npz")
    fields = guessed_map(source, "joint_motion")
    found = import_recordings([source], fields, ImportProcessing())
    write_log(found, [source], fields, folder / "log", {})
    return read_log(folder / "log"), summary(found), found.done


def test_a_log_says_where_recorded_rows_repeat_a_value(tmp_path: Path) -> None:
    stuck = TAU.copy()
    stuck[2000:] = stuck[2000]
    log, words, done = _log(tmp_path, q=Q, tau=stuck)
    assert "tau.0 repeats a value for 9.99 s in all" in words
    [held] = held_of(log.header.provenance, "episode_0000", "tau.0")
    [episode] = log.episodes
    begin = 20.0 - 0.01 * done.reach - 0.5 / done.cutoff
    assert held.begin == pytest.approx(begin) and not held.at_end
    assert held.end == pytest.approx(episode["time"][-1])


def test_saturation_is_said(tmp_path: Path) -> None:
    log, words, _ = _log(tmp_path, q=Q, tau=np.clip(TAU, -2.5, 2.5))
    assert "tau.0 repeats its end value" in words and "saturated?" in words
    held = held_of(log.header.provenance, "episode_0000", "tau.0")
    assert len(held) > 10 and all(each.at_end for each in held)


def test_a_good_recording_says_nothing(tmp_path: Path) -> None:
    log, words, _ = _log(tmp_path, q=Q, tau=TAU)
    assert "repeats" not in words and "turn" not in words
    assert not {"held", "wraps"} & set(log.header.provenance["import"])


def test_an_encoder_that_wraps_is_made_continuous(tmp_path: Path) -> None:
    wrapped = (3.0 * Q + np.pi) % (2.0 * np.pi) - np.pi
    log, words, _ = _log(tmp_path, q=wrapped, tau=TAU)
    jumps = int(np.sum(np.abs(np.diff(wrapped)) > np.pi))
    assert f"jumps of a whole turn taken out: q.0 {jumps} times" in words
    (tmp_path / "plain").mkdir()
    plain, _, _ = _log(tmp_path / "plain", q=3.0 * Q, tau=TAU)
    for name in ("v", "vd"):
        np.testing.assert_allclose(
            log.episodes[0][name], plain.episodes[0][name], atol=1e-6
        )
