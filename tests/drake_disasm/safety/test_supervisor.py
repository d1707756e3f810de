"""The supervisor: waits, lets through, latches, and is resumed."""

import dataclasses

import numpy as np

from drake_disasm.safety import Mode, Situation, Supervisor
from drake_disasm.safety.supervisor import HOLD_SHARE
from tests.drake_disasm.safety.test_guards import USUAL, Q

PERIOD = 0.005  # s
STEP = np.full(7, 0.004)


def supervisor(stop: list[str]) -> Supervisor:
    """Returns one with a guard that says what is in a list."""
    return Supervisor([lambda _: stop[0] if stop else ""], STEP / PERIOD, 0.002, 0.05)


def at(
    q: np.ndarray, wanted: np.ndarray, before: np.ndarray | None = None
) -> Situation:
    before = q if before is None else before
    return dataclasses.replace(USUAL, q_measured=q, q_wanted=wanted, q_before=before)


def test_waits_where_the_arm_is_until_the_command_is_there_too():
    waiting = supervisor(["no data"])  # nothing is sent before anything is measured
    assert np.isnan(waiting.command(at(np.full(7, np.nan), Q))).all()
    assert waiting.mode is Mode.WAITING and waiting.reason == "no data"
    waiting = supervisor([])
    assert np.array_equal(waiting.command(at(Q, Q + 0.01)), Q)
    assert waiting.mode is Mode.WAITING and "0.0100 rad" in waiting.reason
    waiting.command(at(Q, Q + 0.001))
    assert waiting.mode is Mode.ACTIVE and waiting.reason == ""


def test_steps_are_clamped_and_counted():
    active = supervisor([])
    active.command(at(Q, Q))
    assert np.allclose(active.command(at(Q, Q + 0.01)), Q + STEP)
    assert active.clamped == 1 and active.mode is Mode.ACTIVE
    active = supervisor([])
    active.command(at(Q, Q))
    soon = dataclasses.replace(at(Q, Q + 0.01), since_sent=0.5 * PERIOD)
    assert np.allclose(active.command(soon), Q + 0.5 * STEP)  # a limit per second


def test_a_trip_holds_at_the_measured_position_and_says_why():
    stop: list[str] = []
    active = supervisor(stop)
    active.command(at(Q, Q))
    stop.append("first")
    there = Q + 0.001
    step = active.command(at(there, Q + 0.003)) - Q
    assert np.allclose(step, HOLD_SHARE * STEP)  # slowly: the arm springs back
    active.command(at(there, Q + 0.003))
    stop[:] = []
    for _ in range(3):  # latched, though all is well again and the arm is pushed
        assert np.array_equal(active.command(at(Q + 0.002, Q)), there)
    assert active.mode is Mode.HOLD and active.reason == "first"
    active.trip("second", Q, 9.0)
    assert active.reason == "first" and active.held_since == USUAL.now


def test_a_measurement_that_leaped_is_no_place_to_hold_at():
    for wrong in (Q + 0.3, np.full(7, np.nan)):
        stop: list[str] = []
        active = supervisor(stop)
        active.command(at(Q, Q))
        stop.append("jump")
        assert np.array_equal(active.command(at(wrong, Q, before=Q)), Q)


def test_only_resume_ends_a_hold_and_then_it_waits_again():
    held = supervisor([])
    held.command(at(Q, Q))
    held.trip("stop", Q, 1.0)
    held.begin()  # a new episode
    assert held.mode is Mode.HOLD and held.reason == "stop"
    held.resume()
    assert held.mode is Mode.WAITING and np.isnan(held.held_since)
    away = Q + 0.05  # somebody pushed it
    assert np.array_equal(held.command(at(away, Q)), away)
    assert held.mode is Mode.WAITING
    held.command(at(away, away))
    assert held.mode is Mode.ACTIVE


def test_an_arm_that_was_jogged_between_episodes_is_not_sent_back():
    active = supervisor([])
    active.command(at(Q, Q))
    jogged = Q + 0.04
    active.begin()
    assert np.array_equal(active.command(at(jogged, jogged)), jogged)
    assert active.mode is Mode.ACTIVE


def test_a_command_that_was_not_sent_is_not_where_the_next_one_starts() -> None:
    active = supervisor([])
    active.command(at(Q, Q))
    active.command(at(Q, Q + STEP))
    active.withdraw()
    assert np.allclose(active.command(at(Q, Q + 2 * STEP)), Q + STEP)


def test_whoever_moves_is_held_where_nothing_can_be_sent() -> None:
    active = supervisor([])
    active.refuse("deaf", 1.0)
    assert active.mode is Mode.WAITING
    active.command(at(Q, Q))
    active.command(at(Q, Q + STEP))
    active.refuse("deaf", 2.0)
    assert active.mode is Mode.HOLD and active.reason == "deaf"
    assert active.held_since == 2.0
    assert np.array_equal(active.command(at(Q, Q + 2 * STEP)), Q)
