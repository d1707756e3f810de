"""Verdicts as a sentence of plain English."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import registered_effects
from sysid.effect_selection.channel_checks import ChannelFinding
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.effect_names import effects_in_words, in_words
from sysid.effect_selection.experiments import separating
from sysid.effect_selection.left_over import LeftOver
from sysid.effect_selection.settings import DEFAULT_SETTINGS
from sysid.effect_selection.strokes import joints_of_one_stroke
from sysid.effect_selection.verdict import Tie, Undecided
from sysid.effect_selection.verdict_sentence import (
    improvement_in_words,
    indistinguishable_text,
    verdict_sentence,
)
from sysid.models import Channel, LogModel, Measurements
from tests.sysid.effect_selection.verdicts import ERRORS, made_verdict

_FALLS = "the held-out error falls from 10 % to 1 % of the force"


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


def _joints(kind, count):
    return tuple(f"{kind}.j{i}" for i in range(count))


def test_an_arm_that_lacks_friction_and_offsets():
    names = _joints("JointCoulombFriction", 6) + _joints("TorqueOffset", 4)
    assert verdict_sentence(made_verdict("explained", names), ERRORS) == (
        "The model lacks dry friction at six joints and an offset of the torque at "
        f"four; with them {_FALLS}."
    )


def test_none_says_what_the_log_could_have_shown():
    limits = (
        DetectionLimit("SensorLag", "share", 0.01, "1", 0.1),
        DetectionLimit("TorqueOffset.j1", "size", 0.2, "N m", 0.1),
        DetectionLimit("TorqueOffset.j2", "size", None, "N m", 1.2),
        DetectionLimit("GrooveBend", "k", None, "1/m", 3.0),
    )
    assert verdict_sentence(made_verdict("none", limits=limits), ERRORS) == (
        "This log shows nothing that the model lacks: the residual is noise, in which "
        "2 of 3 kinds of effects would have been found if they were large enough."
    )


def test_none_says_that_the_model_states_an_error_of_its_own():
    errors = dataclasses.replace(ERRORS, model_error=np.ones_like(ERRORS.measured))
    assert verdict_sentence(made_verdict("none"), errors) == (
        "This log shows nothing that the model lacks: the residual is noise and what "
        "the model states of its own error."
    )


def test_partly_explained_says_what_is_left():
    findings = tuple(
        ChannelFinding(name, "2 outlying rows (row 4, 5)") for name in ("fx", "fy")
    )
    found = made_verdict("partly", ("SensorLag",), findings=findings)
    assert verdict_sentence(found, ERRORS) == (
        f"The model lacks a slow filter of the sensor; with it {_FALLS}, but not all "
        "is explained: something is left in fx and fy."
    )


def test_what_a_channel_shows_is_said_where_it_is_known():
    findings = (
        ChannelFinding("fx", "periodic at 1.3 Hz (90 %)", "is periodic at 1.3 Hz"),
        ChannelFinding("fy", "periodic at 1.3 Hz (90 %)", "is periodic at 1.3 Hz"),
        ChannelFinding("fy", "3.1 times its noise, of unknown origin"),
        ChannelFinding("tz", "1.4 times its noise, of unknown origin"),
    )
    assert verdict_sentence(
        made_verdict("unexplained", findings=findings), ERRORS
    ).endswith("since fx and fy are periodic at 1.3 Hz and something is left in tz.")


def test_what_a_flexible_learner_finds_is_said():
    left = (
        LeftOver("fx", 0.4, 0.1, "N", ("velocity", "time")),
        LeftOver("fy", 0.2, 0.1, "N", ("velocity",)),
    )
    found = dataclasses.replace(made_verdict("partly", ("SensorLag",)), left_over=left)
    assert verdict_sentence(found, ERRORS).endswith(
        "but not all is explained: up to 40 % of what is left in fx and fy depends on "
        "velocity."
    )


def test_what_few_blocks_can_t_decide_is_not_passed_over():
    more = (Undecided("TorqueRipple", 0.36), Undecided("TorqueOffset", 0.3))
    found = dataclasses.replace(made_verdict("partly", ("SensorLag",)), undecided=more)
    assert verdict_sentence(found, ERRORS).endswith(
        "but not all is explained: 36 % of what is left may be torque ripple or an "
        "offset of the torque, for which this log is too short."
    )


@pytest.mark.parametrize(
    ("left", "why"),
    [
        ({"dependence": "fx depends on time"}, "fx depends on time"),
        ({"excess": 3.14}, "the residual is 3.1 times the noise"),
        (
            {
                "excess": 3.14,
                "against": (Contradiction(("a", "b"), "SensorBias", 0.5),),
            },
            "a contradicts b by an offset of the sensor",
        ),
    ],
)
def test_unexplained_says_why_and_what_is_nearest(left, why):
    lacks = "The model lacks something that no effect of the library explains"
    nearest = f"the nearest is a slow filter of the sensor, with which {_FALLS}"
    assert verdict_sentence(made_verdict("unexplained", **left), ERRORS) == (
        f"{lacks}, since {why}."
    )
    found = made_verdict("unexplained", ("SensorLag",), **left)
    assert verdict_sentence(found, ERRORS) == f"{lacks}, since {why}; {nearest}."


def test_a_few_joints_are_named():
    assert effects_in_words(("RotorInertia.a", "Mine.a", "Mine.b", "MyOwnThing")) == (
        "inertia of the rotor at a, mine at a and b and my own thing"
    )


def test_what_a_log_cannot_tell_apart_is_said_once_for_all_joints():
    names = _joints("JointCoulombFriction", 3)
    ties = tuple(
        (Tie(name.replace("Coulomb", "Load"), "two payloads"),) for name in names
    )
    assert indistinguishable_text(made_verdict("explained", names, ties)) == (
        "This log can't tell dry friction from friction in proportion to the load; to "
        "separate the two, record: two payloads."
    )


def test_a_joint_that_makes_a_single_stroke_is_said_to_be_why():
    ties = ((Tie("JointLoadFriction.rack", "two payloads"),),)
    found = made_verdict("explained", ("JointCoulombFriction.rack",), ties)
    found = dataclasses.replace(found, single_strokes=("rack",))
    assert indistinguishable_text(found).startswith(
        "This log, in which rack makes a single stroke, can't tell dry friction from "
    )


@pytest.mark.parametrize(
    ("position", "is_single"),
    [
        (lambda t: t, True),
        (lambda t: np.maximum(t - 3.0, 0.05 * np.cos(t)), True),
        (lambda t: -np.cos(t), True),
        (lambda t: np.sin(t), False),
    ],
    ids=["one way", "after a rest, and a few rows back", "there and back", "more"],
)
def test_strokes_are_counted_by_reversals(position, is_single):
    t = np.linspace(0.0, 2.0 * np.pi, 200)
    model = Sliding(position(t) + 1e-3 * np.sin(300.0 * t))
    found = joints_of_one_stroke(model, {"rack"}, DEFAULT_SETTINGS)
    assert found == (("rack",) if is_single else ())
    assert joints_of_one_stroke(model, {"another"}, DEFAULT_SETTINGS) == ()


def test_each_episode_is_a_stroke_of_its_own():
    t = np.linspace(0.0, 1.0, 50)
    model = Sliding(np.concatenate([t, t]))
    assert joints_of_one_stroke(model, {"rack"}, DEFAULT_SETTINGS) == ()
    model.measurements = dataclasses.replace(
        model.measurements, episode=np.repeat([0, 1], 50), names=("first", "second")
    )
    assert joints_of_one_stroke(model, {"rack"}, DEFAULT_SETTINGS) == ("rack",)


def test_errors_of_several_units_are_no_shares_and_those_that_rise_are_said():
    channels = (Channel("fx", "N"), Channel("x", "m"), Channel("tx", "N m"))
    errors = dataclasses.replace(
        ERRORS,
        measured=np.zeros((2, 3)),
        before=np.tile([2.0, 1e-6, 0.5], (2, 1)),
        after=np.tile([0.1, 1e-5, 0.499], (2, 1)),
        channels=channels,
    )
    assert improvement_in_words(errors) == (
        "the held-out error falls from 2 to 0.1 N but rises from 1 to 10 "
        "\N{GREEK SMALL LETTER MU}m"
    )


def test_the_unit_that_gains_most_is_said_though_it_is_below_its_noise():
    channels = (Channel("fx", "N", 0.1), Channel("w", "rad", 6e-5))
    errors = dataclasses.replace(
        ERRORS,
        measured=np.zeros((2, 2)),
        before=np.tile([0.109, 5.6e-5], (2, 1)),
        after=np.tile([0.109, 9e-6], (2, 1)),
        channels=channels,
    )
    assert improvement_in_words(errors) == (
        "the held-out error falls from 56 to 9 \N{GREEK SMALL LETTER MU}rad"
    )


def test_a_share_of_readings_near_zero_is_not_given():
    errors = dataclasses.replace(ERRORS, measured=0.01 * ERRORS.measured)
    assert "%" not in improvement_in_words(errors)


def test_a_log_of_the_task_is_not_told_to_record_readings_at_rest():
    for one in registered_effects():
        for other in registered_effects():
            told = separating(one.__name__, other.__name__, at_task=True)
            assert "readings" not in told and "known weight" not in told
    assert "readings" in separating("SensorBias", "GrooveFriction")


def test_effects_of_the_library_have_words_of_their_own():
    words = [in_words(effect.__name__) for effect in registered_effects()]
    assert len(set(words)) == len(words) and all(words)
