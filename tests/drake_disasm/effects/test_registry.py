"""Effects that are defined outside the package, and what is refused as one."""

import dataclasses
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drake_disasm import effects as ef
from drake_disasm import scenario as sc
from drake_disasm.common import executors
from drake_disasm.common.executors import WorkerPool
from drake_disasm.logs import read_log
from drake_disasm.parts import import_own
from drake_disasm.task.simulation import TaskSimulation
from sysid.scenario_parameters import ParameterRequest, scenario_parameters
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refusal
from tests.tools.programs import run_program

_FILE = '''
import dataclasses

import numpy as np

from drake_disasm.effects import Sensing, SensorEffect, amplitude, register_effect


@register_effect
@dataclasses.dataclass
class {name}(SensorEffect):
    """The square of the reading leaks in."""

    fx: float = amplitude("1/N", -0.1, 0.1, "share of the square of fx")

    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        return wrench_S
'''


@pytest.fixture(autouse=True)
def _registry(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Takes out again what a test registers and imports."""
    monkeypatch.setattr(ef.registry, "_effects", dict(ef.registry._effects))
    monkeypatch.setattr(executors, "_modules", dict(executors._modules))
    monkeypatch.setattr(sys, "path", list(sys.path))
    modules = set(sys.modules)
    yield
    for name in set(sys.modules) - modules:
        if name.startswith("own_"):
            del sys.modules[name]


class _Reads(ef.SensorEffect):
    """Not yet an effect; what tests derive from."""

    def apply(self, wrench_S: np.ndarray, sensing: ef.Sensing) -> np.ndarray:
        """Changes nothing."""
        return wrench_S


def _own(name: str = "Own", **fields: object) -> type[ef.SensorEffect]:
    """Returns a dataclass that can be registered; with other fields, maybe not."""
    chosen = fields or {"fx": ef.amplitude("N", -1.0, 1.0, "of the force")}
    return dataclasses.make_dataclass(
        name, [(n, float, field) for n, field in chosen.items()], bases=(_Reads,)
    )


def _file(tmp_path: Path, stem: str, text: str) -> str:
    path = tmp_path / f"{stem}.py"
    path.write_text(text)
    return str(path)


def test_a_registered_effect_comes_last_and_everywhere(tmp_path: Path) -> None:
    own = ef.register_effect(_own())
    assert ef.registered_effects()[-1] is own and ef.find_effect("Own") is own
    scenario = sc.load_scenario(
        "removal", ["effects=[!SensorBias {fy: 1}, !Own {fx: 1}]"]
    )
    assert scenario.effects == [ef.SensorBias(fy=1.0), own(fx=1.0)]
    path = tmp_path / "own.yaml"
    path.write_text(sc.dump_scenario(scenario))
    assert sc.load_scenario(str(path)) == scenario
    assert sc.scenario_from_mapping(sc.scenario_to_mapping(scenario)) == scenario
    for own_effect, words in (
        ("{fx: 2}", "effects.0.fx: 2 N"),
        ("{fz: 2}", "key 'fz'"),
    ):
        override = f"effects=[!Own {own_effect}]"
        assert words in refusal(sc.load_scenario, "removal", [override])
    added, (parameter,) = scenario_parameters(
        sc.Scenario(), [ParameterRequest("Own.fx")]
    )
    assert added.effects == [own()] and parameter.high == 1.0


def test_a_registered_effect_acts_in_a_station() -> None:
    """Around the bolt and in the sensor, beside effects of the library."""

    @ef.register_effect
    @dataclasses.dataclass
    class Lifts(ef.EnvironmentEffect):
        fy: float = ef.amplitude("N", -10.0, 10.0, "along y_G")

        def apply(self, environment, bolt) -> ef.Environment:
            return dataclasses.replace(environment, force_Gn=(0.0, self.fy, 0.0))

    @ef.register_effect
    @dataclasses.dataclass
    class Doubles(_Reads):
        share: float = ef.amplitude("1", -1.0, 1.0, "relative error")
        stage = 2

        def apply(self, wrench_S: np.ndarray, sensing: ef.Sensing) -> np.ndarray:
            return (1.0 + self.share) * wrench_S

    overrides = ["contact.model=impact", QUIET, "Lifts.fy=10"]
    scenario = sc.load_scenario("removal", overrides)
    simulation = TaskSimulation(scenario, "twin")

    def force(effects: list[ef.Effect] | None) -> np.ndarray:
        simulation.reset(0, effects)
        return simulation.step(np.array([1e-3, 0, 0, 0, 0, 0])).observation[6:9]

    lifted, plain = force(None), force([])
    doubled = force([*scenario.effects, Doubles(share=1.0)])
    assert np.abs(lifted - plain).max() > 0.02
    np.testing.assert_allclose(doubled, 2.0 * lifted, rtol=0.02, atol=2e-3)


def test_a_derived_effect_keeps_its_own_tag() -> None:
    """Drake's writer takes the first type of a union that an object is of."""

    @ef.register_effect
    @dataclasses.dataclass
    class Derived(ef.SensorBias):
        square: float = ef.amplitude("1/N", -1.0, 1.0, "more of it")

    scenario = sc.Scenario(effects=[ef.SensorBias(fx=1.0), Derived(fx=2.0)])
    text = sc.dump_scenario(scenario)
    assert "!Derived" in text and "!SensorBias" in text


def test_a_cell_of_a_notebook_may_run_again() -> None:
    first, second = _own(), _own(fy=ef.amplitude("N", -1.0, 1.0, "of the force"))
    ef.register_effect(first)
    ef.register_effect(second)
    assert ef.registered_effects()[-1] is second
    assert first not in ef.registered_effects()
    stale = sc.Scenario(effects=[first()])
    assert "registered again since" in refusal(sc.validate, stale)


def test_names_that_clash_and_joints_that_lack_are_refused() -> None:
    message = refusal(ef.register_effect, _own("SensorBias"))
    assert "sensor.bias" in message and "rename" in message
    assert ef.find_effect("SensorBias") is ef.SensorBias

    class _Rubs(ef.JointEffect):
        def torque(self, samples: ef.JointSamples) -> np.ndarray:
            return samples.v

    own = dataclasses.make_dataclass("Own", [("c", float, _FX)], bases=(_Rubs,))
    assert "`joint: str = joint_name()`" in refusal(ef.register_effect, own)


_FX = ef.amplitude("N", -1.0, 1.0, "of the force")
_T = ef.shape_parameter(1.0, "s", 0.1, 2.0, "time", (1.0, 3.0))
_FAULTY = {
    "not an effect": dataclasses.make_dataclass("Own", [("fx", float, 0.0)]),
    "not a dataclass": type("Own", (_own(),), {}),
    "has no apply": dataclasses.dataclass(type("Own", (ef.SensorEffect,), {})),
    "has no torque": dataclasses.dataclass(type("Own", (ef.JointEffect,), {})),
    "has no amplitude": dataclasses.dataclass(type("Own", (_Reads,), {})),
    "'fx' is not a number with unit and bounds": _own(fx=0.0),
    "'fy' is not a number": _own(fx=_FX, fy=ef.amplitude("", -1, 1, "nothing")),
    "'fz' is not a number": _own(fx=_FX, fz=ef.amplitude("N", -1, np.inf, "far")),
    "'k' is not a number": _own(fx=_FX, k=dataclasses.field(default=1)),
    "'fx': 0 or its grid": _own(fx=ef.amplitude("N", 1.0, 2.0, "never 0")),
    "'T': 1 or its grid": _own(fx=_FX, T=_T),
}


@pytest.mark.parametrize("fault", _FAULTY)
def test_what_is_not_complete_is_refused_in_one_line(fault: str) -> None:
    message = refusal(ef.register_effect, _FAULTY[fault])
    assert message.startswith("effect Own: ") and fault in message, message
    assert ";" in message  # the remedy


def test_an_effect_that_is_not_registered_is_named_with_the_remedy() -> None:
    scenario = sc.Scenario(effects=[_own("Unheard")(fx=0.5)])
    mapping = sc.scenario_to_mapping(scenario)
    for message in (
        refusal(sc.load_scenario, "removal", ["effects=[!Unheard {fx: 1}]"]),
        refusal(sc.scenario_from_mapping, mapping),
    ):
        assert "effects.0: effect 'Unheard' is not registered" in message
        assert "must be imported" in message and "entry point" in message


def test_types_that_are_text_are_understood(tmp_path: Path) -> None:
    text = "from __future__ import annotations\n" + _FILE.format(name="FromText")
    import_own(_file(tmp_path, "own_text", text))
    scenario = sc.load_scenario("removal", ["effects=[!FromText {fx: 0.05}]"])
    assert type(scenario.effects[0]).__name__ == "FromText"


def _in_worker(effect: ef.SensorEffect) -> list[str]:
    """Returns the names of an effect that came by pickle and of a scenario's."""
    scenario = sc.load_scenario("removal", ["effects=[!Spawned {fx: 0.05}]"])
    both = [effect, *scenario.effects]
    return [f"{type(effect).__module__}.{type(effect).__name__}" for effect in both]


def test_a_spawned_worker_knows_what_was_imported(tmp_path: Path) -> None:
    """By pickle, and by name alone, from a file outside any package."""
    import_own(_file(tmp_path, "own_spawned", _FILE.format(name="Spawned")))
    effect = ef.find_effect("Spawned")(fx=0.01)
    with WorkerPool(2) as pool:
        assert pool.map(_in_worker, [effect]) == [["own_spawned.Spawned"] * 2]


_NOT_COMPLETE = """import drake_disasm.effects as e
e.register_effect(type('Own', (e.SensorEffect,), {}))"""


@pytest.mark.parametrize(
    ("stem", "text", "message"),
    [
        ("own_empty", "", "registers no effect or part; put @register_effect"),
        ("own_broken", "1 / 0", "own_broken: can't be imported (ZeroDivisionError"),
        ("json", "", "another module has the name json"),
        ("own_faulty", _NOT_COMPLETE, "own_faulty: effect Own: is not a dataclass"),
    ],
)
def test_a_file_that_gives_no_effect_says_why(stem, text, message, tmp_path) -> None:
    assert message in refusal(import_own, _file(tmp_path, stem, text))
    assert "nowhere.py: no such file" in refusal(import_own, "nowhere.py")
    assert "nowhere: can't be imported" in refusal(import_own, "nowhere")


def test_every_program_that_reads_scenarios_imports_effects(tmp_path: Path) -> None:
    for program in ("simulate", "fake_cell", "identify"):
        done = run_program(program, "--import", "nowhere.py", cwd=tmp_path)
        assert done.returncode == 2, program
        assert "nowhere.py: no such file" in done.stderr


def test_a_program_simulates_an_imported_effect_and_logs_it(tmp_path: Path) -> None:
    file = _file(tmp_path, "own_program", _FILE.format(name="Simulated"))
    done = run_program(
        "simulate", "--import", file, "--set", "Simulated.fx=0.05", "--set",
        "task.steps=2", "--set", "contact.model=impact", "--station", "twin",
        "--policy", "straight", "--no-meshcat", "--record", "log", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    stated = sc.scenario_from_mapping(read_log(tmp_path / "log").header.scenario)
    assert stated.effects == [ef.find_effect("Simulated")(fx=0.05)]


def _install(folder: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Declares a module as an entry point, as an installed distribution does."""
    facts = folder / f"{name}-1.0.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\n")
    entry = f"[drake_disasm.effects]\nany = {name}\n"
    (facts / "entry_points.txt").write_text(entry)
    sys.path.append(str(folder))
    monkeypatch.setattr(ef.registry, "_plugins_are_loaded", False)


def test_an_entry_point_is_loaded_when_effects_are_asked_for(tmp_path, monkeypatch):
    _file(tmp_path, "own_entry", _FILE.format(name="FromEntryPoint"))
    _install(tmp_path, "own_entry", monkeypatch)
    assert ef.find_effect("FromEntryPoint").__module__ == "own_entry"


def test_a_broken_entry_point_is_named(tmp_path, monkeypatch) -> None:
    _install(tmp_path, "own_gone", monkeypatch)
    for _ in range(2):  # the second time, too
        assert "entry point any of own_gone: " in refusal(ef.registered_effects)
