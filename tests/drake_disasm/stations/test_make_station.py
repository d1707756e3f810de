"""Stations by name, and what each of them refuses."""

import dataclasses
from pathlib import Path

import pytest
from pydrake.lcm import DrakeLcm

from drake_disasm.effects import (
    BoltMotion,
    ContactExponent,
    Effect,
    Environment,
    EnvironmentEffect,
    GroovePose,
    JointEffect,
    JointSamples,
    TorqueOffset,
    registry,
)
from drake_disasm.effects.fields import amplitude
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import STATIONS, CellStation, TwinStation, make_station
from drake_disasm.stations.contact import ImpactContactForce
from drake_disasm.stations.hardware import HardwareStation
from drake_disasm.stations.hardware_config import HardwareConfig
from tests.refusals import refused


@pytest.fixture(autouse=True)
def _three_of_them(own_effects: None) -> None:
    for effect in (Magnetism, HotGear, SoftHead):
        registry._effects[effect.__name__] = effect


@dataclasses.dataclass
class Magnetism(Effect):
    """Acts in no place that a station has."""

    field: float = amplitude("T", -1.0, 1.0, "nobody knows where")


@dataclasses.dataclass
class HotGear(JointEffect):
    """A joint effect that the cell does not simulate."""

    joint: str = "iiwa_joint_4"
    size: float = amplitude("N m", -1.0, 1.0, "of an arm that runs hot")

    def torque(self, samples: JointSamples) -> None:
        """Is never asked."""


@dataclasses.dataclass
class SoftHead(EnvironmentEffect):
    """Changes what hydroelastic contact has, and IMPACT has not."""

    share: float = amplitude("1", 0.0, 0.9, "of the head's modulus that is lost")

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        softer = environment.head_modulus * (1.0 - self.share)
        return dataclasses.replace(environment, head_modulus=softer)


def _scenario(*effects: Effect, model: str = "hydroelastic") -> Scenario:
    scenario = load_scenario("removal", [f"contact.model={model}"])
    scenario.effects = list(effects)
    return scenario


def test_every_name_makes_its_station() -> None:
    assert STATIONS == ("cell", "twin", "hardware")
    hardware = make_station(
        "hardware", _scenario(), config=HardwareConfig(), lcm=DrakeLcm("memq://")
    )
    assert isinstance(hardware, HardwareStation)
    file = Path(__file__).parents[3] / "models" / "hardware" / "cell.yaml"
    options = {"config": file, "dry_run": True, "lcm": DrakeLcm("memq://")}
    assert make_station("hardware", _scenario(), **options).dry_run
    assert isinstance(make_station("twin", _scenario(model="impact")), TwinStation)


@pytest.mark.parametrize(("name", "options", "words"), [
    ("twinn", {}, ["no station 'twinn'", "did you mean 'twin'"]),
    ("robot", {}, ["no station 'robot'", "cell, twin, hardware"]),
    ("hardware", {}, ["give config", "models/hardware"]),
    ("hardware", {"config": "none.yaml"}, ["none.yaml: can't be read"]),
    ("cell", {"dry_run": True}, ["station 'cell'", "'dry_run'"]),
])  # fmt: skip
def test_bad_input_is_one_clear_error(name, options, words):
    with refused(*words):
        make_station(name, _scenario(), **options)


REFUSED = [
    ("twin", "hydroelastic", TorqueOffset("iiwa_joint_4", 1.0), "cell"),
    ("twin", "hydroelastic", ContactExponent(0.5), "impact"),
    ("cell", "hydroelastic", ContactExponent(0.5), "twin"),
    ("twin", "impact", SoftHead(0.5), "head_modulus"),
    ("twin", "hydroelastic", Magnetism(0.5), "derive it from one of"),
    ("cell", "hydroelastic", HotGear(size=0.5), "the cell does not simulate"),
    ("hardware", "hydroelastic", GroovePose(ry=0.1), "own effects"),
]


@pytest.mark.parametrize(("name", "model", "effect", "remedy"), REFUSED)
def test_an_effect_that_a_station_cannot_carry_is_named(name, model, effect, remedy):
    options = {"config": HardwareConfig()} if name == "hardware" else {}
    with refused(type(effect).__name__, remedy):
        make_station(name, _scenario(effect, model=model), **options)


@pytest.mark.parametrize("name", ["cell", "twin"])
def test_neither_can_it_be_set_later(name, request):
    station = request.getfixturevalue(name)
    for change in (station.set_effects, station.begin):
        with refused("ContactExponent"):
            change(station.CreateDefaultContext(), [ContactExponent(0.5)])
    with refused("contact.model", "'impact'", "twin"):
        CellStation(_scenario(model="impact"))


def test_the_same_effect_is_carried_where_it_belongs() -> None:
    station = make_station("twin", _scenario(ContactExponent(0.5), model="impact"))
    assert isinstance(station, TwinStation)
    assert isinstance(station.contact, ImpactContactForce)
    system, context = station.contact.system, station.CreateDefaultContext()
    conditions = system.conditions(station.part_context(system, context))
    nominal = station.scenario.contact.impact.exponent
    assert conditions.law.exponent == pytest.approx(nominal + 0.5)
