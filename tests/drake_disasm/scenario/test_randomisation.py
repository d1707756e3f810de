"""Ranges in a scenario: drawn by seed, checked before anything runs."""

from pathlib import Path

import pytest

from drake_disasm.scenario import (
    Scenario,
    draw,
    dump_scenario,
    load_scenario,
    scenario_from_mapping,
    scenario_to_mapping,
    with_values,
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


@pytest.mark.parametrize(
    "parameter", ["effects.0.ry", "lock.clearance", "imprecision", "ft_sensor.noise.2"]
)
def test_values_reach_whatever_has_a_path(parameter: str) -> None:
    scenario = _ranged(parameter, 0.0002, 0.0004)
    drawn = with_values(scenario, {parameter: 0.0003})
    again = load_scenario("removal_turned", [])
    assert drawn.randomisation == [] and scenario.randomisation != []
    found = scenario_to_mapping(drawn)
    for part in parameter.split("."):
        found = found[int(part)] if part.isdecimal() else found[part]
    assert found == 0.0003
    assert scenario_to_mapping(again) != scenario_to_mapping(drawn)


def test_ranges_survive_files_and_mappings(tmp_path: Path) -> None:
    scenario = load_scenario("removal_randomised")
    assert scenario.randomisation
    path = tmp_path / "mine.yaml"
    path.write_text(dump_scenario(scenario))
    assert load_scenario(str(path)) == scenario
    assert scenario_from_mapping(scenario_to_mapping(scenario)) == scenario


@pytest.mark.parametrize(("text", "message"), [
    (RANGE.format("effects.3.ry", 0, 1), "there is no number 3 of 1"),
    (RANGE.format("lock", 0, 1), "is not a number that can vary"),
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
