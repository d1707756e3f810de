import numpy as np
import pytest

from drake_disasm.effects import GroovePose
from drake_disasm.scenario import load_scenario
from sysid.parameters import Parameter, Scaling, by_path
from sysid.scenario_parameters import (
    ParameterRequest,
    read_requests,
    scenario_parameters,
)
from tests.refusals import refused

REMOVAL = load_scenario("removal")


def test_scaling_maps_bounds_to_the_unit_box_and_back():
    scaling = Scaling(
        [Parameter("a", 1.0, -1.0, 3.0), Parameter("k", 1e5, 1e2, 1e8, log_scale=True)]
    )
    np.testing.assert_allclose(scaling.to_unit(np.array([1.0, 1e5])), [0.5, 0.5])
    np.testing.assert_allclose(
        scaling.from_unit(np.array([0.25, 0.25])), [0.0, 10**3.5]
    )
    ends = scaling.from_unit(np.array([[0.0, 0.0], [1.0, 1.0]]))
    np.testing.assert_allclose(ends, [[-1.0, 1e2], [3.0, 1e8]])
    assert (ends >= [-1.0, 1e2]).all() and (ends <= [3.0, 1e8]).all()
    numeric = (scaling.from_unit(np.array([0.5, 0.5 + 1e-7])) - scaling.from_unit(
        np.array([0.5, 0.5]))) / 1e-7  # fmt: skip
    slope = scaling.slope(np.array([1.0, 1e5]))
    assert slope[0] == 4.0 and slope[1] == pytest.approx(numeric[1], rel=1e-5)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((0.0, 1.0, 0.0), "swap"),
        ((0.0, -np.inf, 1.0), "finite"),
        ((2.0, 0.0, 1.0), "nominal"),
    ],
)
def test_refuses_bounds_that_no_search_can_use(arguments, word):
    with refused("p", word):
        Parameter("p", *arguments)
    with refused("p", "logarithmic"):
        Parameter("p", 0.5, 0.0, 1.0, log_scale=True)


def test_names_reach_sections_lists_and_effects():
    names = [
        "contact.friction",
        "gripper.stiffness.2",
        "part.clearance",
        "contact.modulus",
    ]
    _, found = scenario_parameters(REMOVAL, [ParameterRequest(n) for n in names])
    friction, stiffness, clearance, modulus = found
    assert (friction.nominal, friction.low, friction.high) == (0.2, 0.0, 2.0)
    assert stiffness.nominal == 600.0 and stiffness.log_scale
    assert clearance.unit == "m" and not clearance.log_scale
    assert modulus.log_scale


def test_an_effect_that_is_not_there_is_added_at_its_null_value():
    requests = [ParameterRequest("GroovePose.ry"), ParameterRequest("GroovePose.z")]
    scenario, (turn, shift) = scenario_parameters(REMOVAL, requests)
    assert scenario.effects == [GroovePose()] and REMOVAL.effects == []
    assert (turn.name, turn.path) == ("GroovePose.ry", "effects.0.ry")
    assert by_path([turn, shift], {"GroovePose.z": 1e-4}) == {"effects.0.z": 1e-4}


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (ParameterRequest("part"), "not a number"),
        (ParameterRequest("part.clearance", high=0.5), "go beyond"),
        (ParameterRequest("contact.friction", low=0.3), "nominal"),
    ],
)
def test_refuses_what_is_not_there_or_cannot_be(request_, message):
    with refused(request_.name.split(".")[0], message):
        scenario_parameters(REMOVAL, [request_])


def test_reads_names_and_files(tmp_path):
    path = tmp_path / "bounds.yaml"
    path.write_text(
        "contact.friction: {low: 0.1, high: 0.5, nominal: 0.3}\n"
        "contact.modulus: {low: 1.0e+8, high: 1.0e+10, scale: linear}\n"
        "part.clearance:\n"
    )
    requests = read_requests([str(path), "GroovePose.ry"])
    assert [r.name for r in requests][-2:] == ["part.clearance", "GroovePose.ry"]
    _, found = scenario_parameters(REMOVAL, requests)
    assert (found[0].nominal, found[0].low, found[0].high) == (0.3, 0.1, 0.5)
    assert not found[1].log_scale


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[a, b]", "not a mapping"),
        ("contact.friction: {lower: 0}", "unknown key 'lower'"),
        ("contact.friction: {low: 1e-3}", "YAML reads"),
        ("contact.friction: {scale: cubic}", "linear or log"),
        ("contact.friction: 3", "not a mapping"),
    ],
)
def test_refuses_a_file_of_parameters_that_says_nothing(text, message, tmp_path):
    path = tmp_path / "bounds.yaml"
    path.write_text(text)
    with refused("bounds.yaml", message):
        read_requests([str(path)])


def test_refuses_a_missing_file_and_a_name_given_twice():
    with refused("no_such.yaml"):
        read_requests(["no_such.yaml"])
    with refused("a.b", "twice"):
        read_requests(["a.b", "a.b"])
