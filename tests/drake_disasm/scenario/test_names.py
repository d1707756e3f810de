"""Names of fields: the same ones work, and the same are refused, everywhere."""

import pytest

from drake_disasm.effects import (
    GrooveFriction,
    GroovePose,
    JointCoulombFriction,
    RustyPatch,
)
from drake_disasm.scenario import Scenario, load_scenario, validate, with_values
from drake_disasm.scenario.names import find_field, resolve
from drake_disasm.scenario.schema import Range
from sysid.scenario_parameters import ParameterRequest, scenario_parameters
from tests.refusals import refused

#: Names with the paths that they stand for in removal_turned, which lists a GroovePose.
NAMES = {
    "part.clearance": "part.clearance",
    "task.reward.w_f": "task.reward.w_f",
    "imprecision": "imprecision",
    "gripper.stiffness.2": "gripper.stiffness.2",
    "effects.0.ry": "effects.0.ry",
    "GroovePose.ry": "effects.0.ry",
    "GrooveFriction.coefficient": "effects.1.coefficient",
    "JointCoulombFriction.iiwa_joint_4.size": "effects.1.size",
}
#: Names that lead nowhere, with what the message says.
UNKNOWN = {
    "part.clearence": "did you mean 'clearance'?",
    "clearance": "it belongs to part",
    "prt.clearance": "did you mean 'part'?",
    "GroovePse.ry": "did you mean 'GroovePose'?",
    "GroovePose.rw": "known: rx, ry, rz",
    "GroovePose": "'' does not exist",
    "effects.1.ry": "the scenario lists 1 effects, counted from 0",
    "gripper.stiffness.6": "there is no number 6 of 6; count from 0",
    "part.clearance.x": "'x' is not part of a number or word",
    "JointCoulombFriction.size": "write JointCoulombFriction.JOINT.size",
}


def _by_set(name: str, value: float) -> Scenario:
    return load_scenario("removal_turned", [f"{name}={value}"])


def _by_values(name: str, value: float) -> Scenario:
    return with_values(load_scenario("removal_turned"), {name: value})


def _by_range(name: str, value: float) -> Scenario:
    scenario = load_scenario("removal_turned")
    scenario.randomisation = [Range(name, value, value)]
    validate(scenario)
    return with_values(scenario, {name: value})


def _by_parameter(name: str, value: float) -> Scenario:
    scenario = load_scenario("removal_turned")
    scenario, (parameter,) = scenario_parameters(scenario, [ParameterRequest(name)])
    return with_values(scenario, {parameter.path: value})


WAYS = (_by_set, _by_values, _by_range, _by_parameter)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_leads_to_the_same_field_by_all_ways(name: str) -> None:
    scenario, path = resolve(load_scenario("removal_turned"), name)
    assert path == NAMES[name]
    field = find_field(scenario, path)
    assert field.metadata["unit"] and field.can_vary
    value = (field.metadata["low"] + 3.0 * field.metadata["high"]) / 4.0
    found = [way(name, value) for way in WAYS]
    assert find_field(found[0], path).value == value != field.value
    assert found == found[:1] * len(WAYS)


@pytest.mark.parametrize("name", UNKNOWN)
def test_an_unknown_name_is_refused_by_all_ways(name: str) -> None:
    for way in WAYS:
        with refused(f"{name}: ", UNKNOWN[name]):
            way(name, 0.001)


def test_a_name_adds_its_effect_at_null() -> None:
    removal = load_scenario("removal")
    scenario = load_scenario("removal", ["GroovePose.ry=0.02", "GroovePose.z=1e-4"])
    assert scenario.effects == [GroovePose(ry=0.02, z=1e-4)] and removal.effects == []
    turned = "RustyPatch.position=0.02"
    assert load_scenario("removal", [turned]).effects == [RustyPatch(position=0.02)]
    assert resolve(removal, "GroovePose.ry")[0].effects == [GroovePose()]
    assert removal.effects == []


def test_joints_tell_effects_of_a_class_apart() -> None:
    given = ("4.size=3", "2.size=2", "4.creep=0.05")
    overrides = [f"JointCoulombFriction.iiwa_joint_{each}" for each in given]
    scenario = load_scenario("removal", overrides)
    assert scenario.effects == [
        JointCoulombFriction("iiwa_joint_4", 3.0, 0.05),
        JointCoulombFriction("iiwa_joint_2", 2.0),
    ]
    with refused("2 times", "effects.0.size"):
        resolve(scenario, "JointCoulombFriction.size")


def test_what_is_listed_twice_needs_its_number() -> None:
    scenario = Scenario(effects=[GrooveFriction(0.1), GrooveFriction(0.2)])
    with refused("2 times", "effects.0.coefficient"):
        resolve(scenario, "GrooveFriction.coefficient")
    assert resolve(scenario, "effects.1.coefficient")[1] == "effects.1.coefficient"
    turned = load_scenario("removal_turned")
    twice = ("effects.0.ry", "GroovePose.ry")  # two names of one range
    turned.randomisation = [Range(name, 0.0, 0.01) for name in twice]
    with refused("given twice", "effects.0.ry"):
        validate(turned)


def test_sections_effects_and_words_can_be_set_as_well() -> None:
    overrides = ["effects.0={ry: 0.01, z: 1e-3}", "gripper.stiffness.1=9e2"]
    scenario = load_scenario("removal_turned", [*overrides, "gripper.hold=weld"])
    assert scenario.effects == [GroovePose(ry=0.01, z=1e-3)]
    assert scenario.gripper.hold == "weld"
    assert scenario.gripper.stiffness[:3] == [600.0, 900.0, 600.0]
