"""Verdicts in words."""

import pytest

from sysid.effect_selection.channel_checks import ChannelFinding
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.verdict import ParameterValue, Tie
from sysid.effect_selection.verdict_sentence import verdict_sentence
from sysid.effect_selection.verdict_text import verdict_text
from tests.sysid.effect_selection.verdicts import ERRORS, made_verdict

_VALUE = ParameterValue("GrooveFriction.mu", 0.2, "1", (0.1, 0.3), 0.0)
_SHAPE = ParameterValue("SensorLag.tau", 0.5, "s", (0.4, 0.6), None)
_RIVAL = Tie("GrooveBend", "slow pulls both ways")


def _text(*arguments, **more):
    """Returns what is missing, the parameters and the error, each a line."""
    lines = verdict_text(made_verdict(*arguments, **more), ERRORS, most=3).split("\n")
    return [line for line in lines[1:] if not line.startswith("that is: ")]


def test_nothing_is_missing():
    assert _text("none") == [
        "missing: none; the residual is consistent with noise",
        "parameters: none",
        "error on held-out data: 1 -> 0.1 N; 10 -> 1 % of the readings",
    ]


def test_an_effect_with_its_parameters_and_what_to_record():
    missing, values, _ = _text(
        "explained", ("GrooveFriction",), ((_RIVAL,),), (_VALUE,)
    )
    assert missing == (
        "missing: GrooveFriction (or GrooveBend). Not distinguishable from this log; "
        "to separate them, record: slow pulls both ways"
    )
    assert values == "parameters: GrooveFriction.mu = 0.2 (0.1 to 0.3)"


def test_what_effects_leave_is_said():
    missing, *_ = _text("explained", ("SensorLag",), dependence="fx depends on time")
    assert missing == "missing: SensorLag. Left unexplained: fx depends on time"


def test_what_is_left_in_channels_is_said_once_for_all_of_them():
    left = "2 outlying rows in episode_0001 (row 40, 41)"
    findings = [ChannelFinding(name, left) for name in ("fx", "fy")]
    missing, *_ = _text("partly", ("SensorLag",), findings=tuple(findings))
    assert missing == f"missing: SensorLag. Left unexplained: fx, fy: {left}"


def test_none_says_what_would_have_been_found():
    limits = (
        DetectionLimit("SensorLag", "fx", 0.01, "s", 0.1),
        DetectionLimit("SensorLag", "fy", None, "s", 1.2),
        DetectionLimit("GrooveBend", "k", None, "1/m", 3.0),
    )
    assert _text("none", limits=limits)[0] == (
        "missing: none; the residual is consistent with noise; 1 of 2 effects would "
        "have been found (from which amplitude on: result.json), not GrooveBend"
    )


def test_no_library_effect_explains_it_and_the_nearest():
    missing, *_ = _text("unexplained", ("SensorLag",), excess=3.14)
    assert missing == (
        "No library effect explains the residual: the residual is 3.1 times the "
        "noise. Nearest: SensorLag"
    )


def test_episodes_that_contradict_each_other_come_before_the_size_of_the_residual():
    against = (Contradiction(("a", "b"), "SensorBias", 0.5),)
    missing, *_ = _text("unexplained", against=against, excess=2.0)
    assert missing.endswith(
        "episodes that no common effect explains: a against b (SensorBias)"
    )
    assert "times" not in missing


def test_the_joint_of_a_tie_is_not_repeated_and_many_are_counted():
    names = ("Friction.j1",)
    ties = (tuple(Tie(f"E{i}.j1", "rests") for i in range(5)),)
    missing, *_ = _text("explained", names, ties)
    assert "Friction.j1 (or E0 or E1 or E2 or 2 more)" in missing
    assert missing.endswith("record: rests")


@pytest.mark.parametrize(("count", "is_shown"), [(1, True), (4, False)])
def test_shape_parameters_are_listed_for_few_effects(count, is_shown):
    names = ("SensorLag", "A", "B", "C")[:count]
    _, values, _ = _text("explained", names, values=(_SHAPE,))
    assert ("SensorLag.tau = 0.5 s" in values) == is_shown


def test_a_parameter_that_may_be_null_is_not_listed():
    value = ParameterValue("SensorLag.size", 0.1, "N", (-0.1, 0.3), 0.0)
    assert _text("explained", ("SensorLag",), values=(value,))[1] == "parameters: none"


def test_a_value_at_a_bound_is_marked():
    value = ParameterValue("SensorLag.share", 1.0, "1", (0.9, 1.0), 0.0, True)
    _, values, _ = _text("explained", ("SensorLag",), values=(value,))
    assert values.endswith("SensorLag.share = 1 (0.9 to 1, at its bound)")


def test_the_sentence_comes_first_and_names_are_said_in_words():
    names = tuple(f"JointCoulombFriction.j{i}" for i in range(3))
    found = made_verdict("explained", names)
    sentence, missing, meaning, *_ = verdict_text(found, ERRORS, 3).split("\n")
    assert sentence == verdict_sentence(found, ERRORS)
    assert missing == "missing: JointCoulombFriction of 3 joints"
    assert meaning == (
        "that is: JointCoulombFriction: Dry friction of constant size against the "
        "motion."
    )
