"""What a verdict states in words: names, numbers, the ending and what to record."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import registered_effects
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.effect_names import effects_in_words, in_words
from sysid.effect_selection.strokes import joints_of_one_stroke
from sysid.effect_selection.verdict import ParameterValue, Tie, Written
from sysid.effect_selection.verdict_words import (
    error_in_words,
    kind_lines,
    not_told_apart,
    verdict_sentence,
    verdict_text,
)
from sysid.models import Channel, LogModel, Measurements
from sysid.residuals.channel_checks import ChannelFinding
from sysid.residuals.predictable_residual import PredictableResidual
from tests.sysid.effect_selection.verdicts import ERRORS, made_verdict

_LAG, _FRICTION = ("SensorLag",), tuple(f"JointCoulombFriction.j{i}" for i in range(3))
_AGAINST = (Contradiction(("a", "b"), "SensorBias", 0.5),)
_SINE = (ChannelFinding("fx", "periodic at 1.3 Hz (90 %)"),)
_LEFT = (PredictableResidual("fx", 0.4, 0.1, "N", ("velocity", "time")),)
_LIMITS = (
    DetectionLimit("SensorLag", "fx", 0.01, "s", 0.1),
    DetectionLimit("GrooveBend", "k", None, "1/m", 3.0),
)
_SIGN = (Written("TorqueSign", "j1 has the other sign", "flip it"),)


@pytest.mark.parametrize(
    ("ending", "names", "more", "stated"),
    [
        ("none", (), {"limits": _LIMITS}, ["noise", "1 of 2", "GrooveBend"]),
        ("too short", (), {"limits": _LIMITS}, ["too short", "1 of 2", "GrooveBend"]),
        ("none", (), {"is_provisional": True}, ["So far"]),
        ("explained", _FRICTION, {}, [in_words(_FRICTION[0]), "from 10 to 1 %"]),
        ("partly", _LAG, {"predictable_residual": _LEFT}, ["40 %", "fx", "velocity"]),
        ("partly", _LAG, {"relative_error": 0.49}, ["large"]),
        ("partly", _LAG, {"invalid": "drag is too strong"}, ["drag is too strong"]),
        ("unexplained", _LAG, {"excess": 3.14}, ["no effect is confirmed", "3.1"]),
        ("unexplained", (), {"findings": _SINE}, ["fx: periodic at 1.3 Hz"]),
        ("unexplained", (), {"correlated": ("fx",)}, ["fx is correlated"]),
        ("unexplained", (), {"contradictions": _AGAINST}, ["a contradicts b"]),
        ("unexplained", (), {"is_provisional": True}, ["tried so far"]),
        ("explained", _LAG, {"misfits": ("moving (drop)",)}, ["moving (drop)", "slow"]),
        ("none", (), {"written": _SIGN}, ["other sign (flip it)", "noise"]),
    ],
)
def test_a_text_states_names_numbers_and_the_ending(ending, names, more, stated):
    text = verdict_text(made_verdict(ending, names, **more), ERRORS)
    assert all(words in text for words in stated), text


def _mixed():
    """Returns a verdict with an effect of each standing, at several joints."""
    ties = ((), (Tie("JointLoadFriction.j0 and ArmTilt", "weights; turns"),), ())
    names = ("SensorLag", "JointCoulombFriction.j0", "SensorBias")
    found = made_verdict("partly", names, ties, predictable_residual=_LEFT)
    reason = "2 of 4 parts ask"
    bias = dataclasses.replace(found.standings[2], status="suggested", reason=reason)
    return dataclasses.replace(found, standings=(*found.standings[:2], bias))


def test_nothing_is_said_twice():
    found = dataclasses.replace(_mixed(), relative_error=0.5, contradictions=_AGAINST)
    lines = verdict_text(found, ERRORS).split("\n")
    assert lines[0] == verdict_sentence(found, ERRORS)
    phrases = ("velocity", "a contradicts b", "2 of 4", "weights", "SensorLag", "1 %")
    assert all("\n".join(lines).count(each) == 1 for each in phrases), lines


def test_effects_of_a_kind_and_standing_are_one_line():
    ties = tuple((Tie(f"E{i}.j0", "rests; turns"),) for i in range(3))
    found = made_verdict("explained", _FRICTION, ties)
    reason = "2 of 4 parts ask"
    last = dataclasses.replace(found.standings[2], status="suggested", reason=reason)
    found = dataclasses.replace(found, standings=(*found.standings[:2], last))
    several, one = kind_lines(found)
    assert (several.names, several.status) == (_FRICTION[:2], "ambiguous")
    assert (several.rivals, several.experiments) == (("E0", "E1"), ("rests", "turns"))
    assert (several.reasons, one.reasons) == ((), (reason,))
    assert (one.names, one.rivals) == (_FRICTION[2:], ("E2",))


def test_a_line_has_intervals_and_rivals():
    ties = (tuple(Tie(f"E{i}.j0", "rests") for i in range(5)),)
    sizes = [(0.2, (0.1, 0.3)), (0.1, (-0.1, 0.3))]
    values = tuple(
        ParameterValue(f"{_FRICTION[0]}.x{i}", value, "N m", interval, 0.0, i == 0)
        for i, (value, interval) in enumerate(sizes)
    )
    found = made_verdict("explained", _FRICTION[:1], ties, values)
    (line,) = kind_lines(found)
    assert line.title == _FRICTION[0] and line.values == values[:1]  # one holds null
    (alone,) = kind_lines(made_verdict("explained", _FRICTION[:1], ties, values[1:]))
    assert alone.values == values[1:]  # it has no other
    assert "x0 = 0.2 N m (0.1 to 0.3, at its bound)" in line.details
    assert "E0, E1, E2 or 2 more" in line.details
    *_, record, errors = verdict_text(found, ERRORS).split("\n")
    assert record.endswith("record: rests")
    assert errors.endswith("fx 1 -> 0.1 N")


def test_effects_have_words_of_their_own_and_a_few_joints_are_named():
    assert effects_in_words(("RotorInertia.a", "Mine.a", "Mine.b", "MyOwnThing")) == (
        "inertia of the rotor at a, mine at a and b and my own thing"
    )
    words = [in_words(effect.__name__) for effect in registered_effects()]
    assert len(set(words)) == len(words) and all(words)


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


_FORCE, _WAY = Channel("fx", "N", 0.1), Channel("w", "rad", 6e-5)


@pytest.mark.parametrize(
    ("channels", "before", "after", "words"),
    [
        ((_FORCE, Channel("x", "m")), [2.0, 1e-6], [0.1, 1e-5], ["from 1 to 10 μm"]),
        ((_FORCE, _WAY), [0.109, 5.6e-5], [0.109, 9e-6], ["falls from 56 to 9 μrad"]),
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
    text = error_in_words(errors)
    assert "%" not in text and all(w in text for w in words)


def test_none_owns_that_the_model_states_an_error_of_its_own():
    errors = dataclasses.replace(ERRORS, model_error=np.ones_like(ERRORS.measured))
    assert "its own error" in verdict_sentence(made_verdict("none"), errors)
    assert "its own error" not in verdict_sentence(made_verdict("none"), ERRORS)


def test_what_a_log_cannot_tell_apart_is_said_once_for_all_joints():
    ties = tuple(
        (Tie(n.replace("Coulomb", "Load"), "two payloads"),) for n in _FRICTION
    )
    found = made_verdict("explained", _FRICTION, ties)
    text = not_told_apart(found)
    assert text.count("friction in proportion to the load") == 1
    assert text.endswith("record: two payloads.") and "stroke" not in text
    found = dataclasses.replace(found, single_strokes=("j0",))
    assert "j0 makes a single stroke" in not_told_apart(found)
