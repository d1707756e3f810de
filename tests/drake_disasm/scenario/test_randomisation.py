"""Ranges in a scenario: drawn by seed, checked before anything runs."""

import pytest

from drake_disasm.scenario import (
    Scenario,
    draw,
    load_scenario,
)
from tests.refusals import refused

RANGE = "randomisation=[{{parameter: {}, low: {}, high: {}}}]"


def _ranged(parameter: str, low: object, high: object, *others: str) -> Scenario:
    return load_scenario(
        "removal_turned", [*others, RANGE.format(parameter, low, high)]
    )


def test_draws_repeat_by_seed_and_stay_in_their_range() -> None:
    scenario = _ranged("contact.friction", 0.1, 0.3)
    values = [draw(scenario, seed)["contact.friction"] for seed in range(200)]
    assert values[7] == draw(scenario, 7)["contact.friction"]
    assert 0.1 <= min(values) < 0.11 and 0.29 < max(values) <= 0.3
    assert len(set(values)) == 200


@pytest.mark.parametrize(("text", "message"), [
    (RANGE.format("effects.3.ry", 0, 1), "there is no number 3 of 1"),
    (RANGE.format("part", 0, 1), "is not a number that can vary"),
    (RANGE.format("gripper.hold", 0, 1), "is not a number that can vary"),
    (RANGE.format("contact.friction", 0.3, 0.1), "is above high"),
    (RANGE.format("contact.friction", 0.1, 5), "with every high end"),
    (RANGE.format("contact.friction", "a", 5), "is not a number"),
    ("randomisation=3", "randomisation: is not a list"),
    ("randomisation=[{paramter: a}]", "unknown key 'paramter'"),
    ("randomisation=[{parameter: imprecision, low: 0, high: 0},"
     " {parameter: imprecision, low: 0, high: 0}]", "is given twice"),
])  # fmt: skip
def test_what_is_wrong_is_named(text: str, message: str) -> None:
    with refused(message):
        load_scenario("removal_turned", [text])
