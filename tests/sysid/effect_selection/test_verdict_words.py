"""What a verdict states in words: names, numbers, the ending and what to record."""

import dataclasses
import itertools

import numpy as np
import pytest

from drake_disasm.effects import ArmEffect, registered_effects
from sysid.effect_selection.channel_checks import ChannelFinding
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.effect_names import effects_in_words, in_words
from sysid.effect_selection.experiments import separating
from sysid.effect_selection.left_over import LeftOver
from sysid.effect_selection.strokes import joints_of_one_stroke
from sysid.effect_selection.verdict import ParameterValue, Tie, Written
from sysid.effect_selection.verdict_sentence import (
    improvement_in_words,
    indistinguishable_text,
    verdict_sentence,
)
from sysid.effect_selection.verdict_text import verdict_text
from sysid.models import Channel, LogModel, Measurements
from tests.sysid.effect_selection.verdicts import ERRORS, made_verdict

_LAG = ("SensorLag",)
_AGAINST = (Contradiction(("a", "b"), "SensorBias", 0.5),)
_TWO = tuple(ChannelFinding(c, "2 outlying rows (row 4, 5)") for c in ("fx", "fy"))
_SINE = ChannelFinding("fx", "periodic at 1.3 Hz (90 %)", "is periodic at 1.3 Hz")
_LEFT = (LeftOver("fx", 0.4, 0.1, "N", ("velocity", "time")),)
_LIMITS = (
    DetectionLimit("SensorLag", "fx", 0.01, "s", 0.1),
    DetectionLimit("SensorLag", "fy", None, "s", 1.2),
    DetectionLimit("GrooveBend", "k", None, "1/m", 3.0),
)
_VALUE = ParameterValue("GrooveFriction.mu", 0.2, "1", (0.1, 0.3), 0.0)
_SHAPE = ParameterValue("SensorLag.tau", 0.5, "s", (0.4, 0.6), None)
_MAYBE_NULL = ParameterValue("SensorLag.size", 0.1, "N", (-0.1, 0.3), 0.0)
_AT_BOUND = ParameterValue("SensorLag.share", 1.0, "1", (0.9, 1.0), 0.0, True)


def _joints(kind, count):
    return tuple(f"{kind}.j{i}" for i in range(count))


@pytest.mark.parametrize(
    ("verdict", "stated"),
    [
        (made_verdict("none", limits=_LIMITS), ["residual is noise", "1 of 2"]),
        (
            made_verdict("too short", limits=_LIMITS),
            ["too short", "1 of 2", effects_in_words(("GrooveBend",))],
        ),
        (
            made_verdict("explained", _joints("JointCoulombFriction", 6)),
            ["dry friction at six joints", "10 %", "1 %"],
        ),
        (made_verdict("partly", _LAG, findings=_TWO), ["not all", "fx and fy"]),
        (made_verdict("unexplained", findings=(_SINE,)), ["fx is periodic at 1.3 Hz"]),
        (made_verdict("partly", _LAG, left_over=_LEFT), ["40 %", "fx", "velocity"]),
        (
            made_verdict("unexplained", _LAG, excess=3.14),
            ["no effect is confirmed", "3.1 times", "slow filter", "2 of 4 parts"],
        ),
        (made_verdict("unexplained", dependence="fx depends on time"), ["on time"]),
        (made_verdict("unexplained", correlated=("fx",)), ["of fx is correlated"]),
        (made_verdict("partly", _LAG, relative_error=0.49), ["49 % of what was"]),
        (
            made_verdict("unexplained", excess=3.14, contradictions=_AGAINST),
            ["a contradicts b", "an offset of the sensor"],
        ),
        (
            made_verdict("explained", _LAG, misfits=("moving rows (drop)",)),
            ["moving rows (drop)", "slow filter"],
        ),
        (
            made_verdict("none", written=(Written("Sign", "j1 turned", "flip it"),)),
            ["j1 turned (flip it)", "residual is noise"],
        ),
    ],
)
def test_a_sentence_states_names_numbers_and_the_ending(verdict, stated):
    sentence = verdict_sentence(verdict, ERRORS)
    for words in stated:
        assert words in sentence


def test_confirmed_names_come_before_what_is_suggested():
    found = made_verdict("partly", ("SensorLag", "SensorBias"))
    lag, bias = found.standings
    bias = dataclasses.replace(bias, status="suggested", reason="2 of 4 parts ask")
    found = dataclasses.replace(found, standings=(lag, bias))
    assert (found.confirmed, found.suggested) == (("SensorLag",), ("SensorBias",))
    sentence = verdict_sentence(found, ERRORS)
    assert sentence.index("slow filter") < sentence.index("Suggested")
    assert sentence.index("Suggested") < sentence.index("offset")


def test_a_sentence_of_none_owns_that_the_model_states_an_error_of_its_own():
    errors = dataclasses.replace(ERRORS, model_error=np.ones_like(ERRORS.measured))
    assert "its own error" in verdict_sentence(made_verdict("none"), errors)
    assert "its own error" not in verdict_sentence(made_verdict("none"), ERRORS)


def _text(*arguments, **more):
    """Returns what is missing, the parameters and the error, each a line."""
    lines = verdict_text(made_verdict(*arguments, **more), ERRORS, most=3).split("\n")
    return [line for line in lines[1:] if not line.startswith("that is: ")]


def test_the_text_begins_with_the_sentence_and_ends_with_the_errors():
    found = made_verdict("explained", _joints("JointCoulombFriction", 3))
    sentence, missing, meaning, *_, errors = verdict_text(found, ERRORS, 3).split("\n")
    assert sentence == verdict_sentence(found, ERRORS)
    assert missing == "missing: JointCoulombFriction of 3 joints (3 confirmed)"
    assert meaning.startswith("that is: JointCoulombFriction: ")
    assert errors.endswith("1 -> 0.1 N; 10 -> 1 % of the readings")


@pytest.mark.parametrize(
    ("arguments", "more", "begin", "end"),
    [
        (("none",), {"limits": _LIMITS}, "missing: none", "not GrooveBend"),
        (
            ("explained", _LAG),
            {"dependence": "fx depends on time"},
            "missing: Sen",
            "time",
        ),
        (("partly", _LAG), {"findings": _TWO}, "missing: SensorLag", "(row 4, 5)"),
        (("unexplained", _LAG), {"excess": 3.14}, "No effect", "(1 suggested)"),
        (
            ("unexplained",),
            {"contradictions": _AGAINST, "excess": 2.0},
            "No",
            "(SensorBias)",
        ),
        (
            (
                "explained",
                ("Friction.j1",),
                (tuple(Tie(f"E{i}.j1", "rests") for i in range(5)),),
            ),
            {},
            "missing: Friction.j1 (or E0 or E1 or E2 or 2 more)",
            "record: rests (1 ambiguous)",
        ),
    ],
)
def test_the_text_names_what_is_missing_and_what_is_left(arguments, more, begin, end):
    missing, *_ = _text(*arguments, **more)
    assert missing.startswith(begin) and missing.endswith(end)


@pytest.mark.parametrize(
    ("names", "value", "shown"),
    [
        (("GrooveFriction",), _VALUE, "GrooveFriction.mu = 0.2 (0.1 to 0.3)"),
        (_LAG, _SHAPE, "SensorLag.tau = 0.5 s"),
        ((*_LAG, "A", "B", "C"), _SHAPE, "parameters: none"),  # of few effects alone
        (_LAG, _MAYBE_NULL, "parameters: none"),
        (_LAG, _AT_BOUND, "1 (0.9 to 1, at its bound)"),
    ],
)
def test_the_text_lists_parameters_with_their_intervals(names, value, shown):
    _, values, _ = _text("explained", names, values=(value,))
    assert shown in values


def test_effects_have_words_of_their_own_and_a_few_joints_are_named():
    assert effects_in_words(("RotorInertia.a", "Mine.a", "Mine.b", "MyOwnThing")) == (
        "inertia of the rotor at a, mine at a and b and my own thing"
    )
    words = [in_words(effect.__name__) for effect in registered_effects()]
    assert len(set(words)) == len(words) and all(words)


def test_what_a_log_cannot_tell_apart_is_said_once_for_all_joints():
    names = _joints("JointCoulombFriction", 3)
    ties = tuple(
        (Tie(name.replace("Coulomb", "Load"), "two payloads"),) for name in names
    )
    found = made_verdict("explained", names, ties)
    text = indistinguishable_text(found)
    assert text.count("friction in proportion to the load") == 1
    assert text.endswith("record: two payloads.") and "stroke" not in text
    found = dataclasses.replace(found, single_strokes=("j0",))
    assert "j0 makes a single stroke" in indistinguishable_text(found)


class Sliding(LogModel):
    """A joint with a position (n,)."""

    parameters = ()

    def __init__(self, q):
        self.q = q
        self.measurements = Measurements.of_array(q, [Channel("rack", "N")])

    def covariates(self, channel):
        return {"position": self.q}

    def predict(self, theta, rows):
        return self.q[rows]

    def select_rows(self, mask):
        return Sliding(self.q[mask])


@pytest.mark.parametrize(
    ("position", "is_single"),
    [
        (lambda t: np.maximum(t - 3.0, 0.05 * np.cos(t)), True),
        (lambda t: -np.cos(t), True),
        (lambda t: np.sin(t), False),
    ],
    ids=["after a rest, and a few rows back", "there and back", "more"],
)
def test_strokes_are_counted_by_reversals_and_episodes(position, is_single):
    t = np.linspace(0.0, 2.0 * np.pi, 200)
    model = Sliding(np.tile(position(t) + 1e-3 * np.sin(300.0 * t), 2))
    assert joints_of_one_stroke(model, {"rack"}) == ()
    model.measurements = dataclasses.replace(
        model.measurements, episode=np.repeat([0, 1], 200), names=("first", "second")
    )
    found = joints_of_one_stroke(model, {"rack"})
    assert found == (("rack",) if is_single else ())
    assert joints_of_one_stroke(model, {"another"}) == ()


@pytest.mark.parametrize(
    ("channels", "before", "after", "words"),
    [
        (
            (Channel("fx", "N"), Channel("x", "m"), Channel("tx", "N m")),
            [2.0, 1e-6, 0.5],
            [0.1, 1e-5, 0.499],
            ["falls from 2 to 0.1 N", "rises from 1 to 10 μm"],
        ),
        (
            (Channel("fx", "N", 0.1), Channel("w", "rad", 6e-5)),
            [0.109, 5.6e-5],
            [0.109, 9e-6],  # below its noise
            ["falls from 56 to 9 μrad"],
        ),
    ],
)
def test_errors_that_fall_and_rise_are_said_in_their_units(
    channels, before, after, words
):
    errors = dataclasses.replace(
        ERRORS,
        measured=np.zeros((2, len(channels))),  # no shares of them
        before=np.tile(before, (2, 1)),
        after=np.tile(after, (2, 1)),
        channels=channels,
    )
    text = improvement_in_words(errors)
    assert "%" not in text and all(w in text for w in words)


def test_a_log_of_the_task_is_not_told_to_record_readings_at_rest():
    of_task = [e for e in registered_effects() if not issubclass(e, ArmEffect)]
    for one, other in itertools.product(of_task, of_task):
        told = separating(one.__name__, other.__name__, at_task=True)
        assert "readings" not in told and "known weight" not in told
    assert "readings" in separating("SensorBias", "GrooveFriction")
