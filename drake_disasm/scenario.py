"""Scenarios: typed YAML files that each denote one diagram.

`load_scenario` reads a file (strictly: an unknown key is an error), applies
overrides such as `lock.clearance=0.0003`, and checks every value against its
bounds. Each part of the cell has its own plain dataclass with valid defaults.
All values are SI.
"""

import dataclasses
import re
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from drake_disasm.effects import EFFECTS, Effect
from drake_disasm.errors import DisasmError
from drake_disasm.quantity import check, closest, quantity
from drake_disasm.resources import models_dir


@dataclasses.dataclass
class Untagged(Effect):
    """Stands first in the union so that every effect needs its `!Name` tag."""


#: The tagged union that `effects:` is a list of.
AnyEffect = typing.Union[(Untagged, *EFFECTS)]  # type: ignore[valid-type]


@dataclasses.dataclass
class SimulationConfig:
    """How the MultibodyPlant is discretised (how chosen: docs/physics.md)."""

    cell_time_step: float = quantity(0.0025, "s", "of the cell", low=1e-4, high=0.02)
    twin_time_step: float = quantity(0.005, "s", "of the twin", low=1e-4, high=0.02)
    stiction_tolerance: float = quantity(
        1e-5, "m/s", "creep at which friction is full", low=1e-7, high=1e-2
    )
    contact_approximation: str = quantity(
        "lagged", "", "of the discrete solver", choices=("lagged", "similar", "sap")
    )


@dataclasses.dataclass
class LockConfig:
    """Dimensions of the door-chain lock (own design, see models/SOURCES.md)."""

    neck_diameter: float = quantity(0.005, "m", "bolt's neck", low=0.002, high=0.02)
    head_diameter: float = quantity(0.010, "m", "bolt's head", low=0.003, high=0.04)
    head_thickness: float = quantity(0.002, "m", "bolt's head", low=0.001, high=0.01)
    clearance: float = quantity(
        0.0004, "m", "slot width minus neck diameter", low=1e-4, high=1e-3
    )
    channel_clearance: float = quantity(
        0.001, "m", "channel width minus head diameter", low=1e-4, high=5e-3
    )
    axial_clearance: float = quantity(
        0.0004, "m", "channel height minus head thickness", low=1e-4, high=5e-3
    )
    lip_thickness: float = quantity(
        0.0025, "m", "of the lips that form the slot", low=1e-3, high=0.01
    )
    travel: float = quantity(0.060, "m", "from A to B", low=0.02, high=0.15)
    keyhole_clearance: float = quantity(
        0.001, "m", "keyhole width minus head diameter", low=2e-4, high=5e-3
    )
    grip_size: list[float] = quantity(
        [0.024, 0.030, 0.012], "m", "bolt's grip along x, y, z", low=0.004, high=0.05
    )
    grip_standoff: float = quantity(
        0.003, "m", "gap between plate and grip", low=0.001, high=0.05
    )
    bolt_mass: float = quantity(
        0.2, "kg", "of the bolt and its chain", low=0.001, high=1.0
    )


@dataclasses.dataclass
class ContactConfig:
    """Hydroelastic contact: the groove is rigid, the bolt's neck and head yield."""

    modulus: float = quantity(
        4e9, "Pa", "hydroelastic modulus of the bolt's neck", low=1e6, high=1e11
    )
    head_modulus: float = quantity(
        4e7, "Pa", "hydroelastic modulus of the bolt's head", low=1e5, high=1e11
    )
    dissipation: float = quantity(20.0, "s/m", "Hunt-Crossley", low=0.0, high=500.0)
    friction: float = quantity(0.2, "1", "Coulomb, static = dynamic", low=0, high=2)
    resolution: float = quantity(
        0.0008, "m", "edge length on the bolt's mesh", low=1e-4, high=5e-3
    )


@dataclasses.dataclass
class ArmConfig:
    """The arm and its joint position controller."""

    model: str = quantity(
        "package://disasm_models/iiwa14/iiwa14.urdf", "", "URDF of the arm"
    )
    posture: list[float] = quantity(
        [0.0, 0.6, 0.0, -1.4, 0.0, 1.14, 0.0], "rad", "preferred joint angles",
        low=-3.0, high=3.0,
    )  # fmt: skip
    stiffness: list[float] = quantity(
        [20e3, 8e3, 20e3, 8e3, 8e3, 8e3, 8e3], "N m/rad", "of each joint",
        low=10.0, high=1e6,
    )  # fmt: skip
    damping_ratio: float = quantity(
        1.0, "1", "of each joint about its own inertia", low=0.1, high=5.0
    )
    control_period: float = quantity(
        0.005, "s", "of the position interface", low=1e-3, high=0.02
    )


@dataclasses.dataclass
class GripperConfig:
    """The gripper and how it holds the bolt."""

    model: str = quantity(
        "package://disasm_models/gripper_2f140/gripper_2f140.urdf", "", "URDF"
    )
    hold: str = quantity(
        "friction", "", "how the bolt is held", choices=("friction", "weld")
    )
    grip_force: float = quantity(60.0, "N", "on each pad", low=10.0, high=125.0)
    fingertip_gap: float = quantity(
        0.0015, "m", "between fingertips and plate", low=0.001, high=0.05
    )
    finger_stiffness: float = quantity(
        3e4, "N/m", "of each finger about its commanded place", low=1e3, high=1e6
    )


@dataclasses.dataclass
class SensorConfig:
    """OnRobot HEX-E: noise and resolution per channel [f; tau] in S."""

    model: str = quantity("package://disasm_models/hex_e/hex_e.urdf", "", "URDF")
    period: float = quantity(0.01, "s", "between samples", low=0.002, high=1.0)
    noise: list[float] = quantity(
        [0.035, 0.035, 0.15, 0.002, 0.002, 0.001], "N, N m", "standard deviation",
        low=0.0, high=10.0,
    )  # fmt: skip
    quantum: list[float] = quantity(
        [1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5], "N, N m", "one count on the wire",
        low=0.0, high=10.0,
    )  # fmt: skip


@dataclasses.dataclass
class PlacementConfig:
    """Where the lock is believed to be: frame Gn, x along the groove, y up."""

    p_WG: list[float] = quantity(
        [0.6, 0.0, 0.22], "m", "point A in the world", low=-1.5, high=1.5
    )
    yaw: float = quantity(0.0, "rad", "of x_G about z_W", low=-3.2, high=3.2)


@dataclasses.dataclass
class TwinConfig:
    """Arm, gripper and sensor as seen from the bolt: a six-axis spring-damper.

    In the axes of Gn: translations x, y, z, then rotations about x, y, z. The
    stiffness is the cell's own, measured at A (docs/physics.md says how).
    """

    stiffness: list[float] = quantity(
        [16.6e3, 15.4e3, 13.4e3, 410.0, 280.0, 2000.0], "N/m, N m/rad", "",
        low=1.0, high=1e7,
    )  # fmt: skip
    damping_ratio: float = quantity(1.0, "1", "of each axis", low=0.1, high=10.0)
    mass: float = quantity(2.0, "kg", "moved along with the bolt", low=0.01, high=50)
    inertia: float = quantity(
        0.005, "kg m^2", "turned along with the bolt", low=1e-5, high=5.0
    )


@dataclasses.dataclass
class RewardConfig:
    """Weights and limits of the reward (thesis, eq. 3.4 and 4.3)."""

    w_dis: float = quantity(1.6, "1/mm", "progress along x", low=0.0, high=100.0)
    w_f: float = quantity(0.3, "1", "force", low=0.0, high=100.0)
    w_t: float = quantity(0.3, "1", "torque", low=0.0, high=100.0)
    w_y: float = quantity(5.0, "1/mm", "lift near the end", low=0.0, high=100.0)
    f_max: float = quantity(20.0, "N", "safety force", low=1.0, high=200.0)
    t_max: float = quantity(5.0, "N m", "safety torque", low=0.1, high=50.0)


@dataclasses.dataclass
class TaskConfig:
    """The Markov decision process."""

    success: str = quantity(
        "removed", "", "what counts as success", choices=("travelled", "removed")
    )
    steps: int = quantity(100, "1", "limit per episode", low=1, high=100000)
    period: float = quantity(0.1, "s", "of one step", low=0.01, high=5.0)
    max_translation: float = quantity(0.003, "m", "per step", low=1e-5, high=0.05)
    max_rotation: float = quantity(0.0174533, "rad", "per step", low=1e-5, high=0.5)
    travel_success: float = quantity(0.055, "m", "x travelled", low=0.001, high=0.2)
    lift_success: float = quantity(
        0.002, "m", "head's underside above the plate", low=0.0, high=0.05
    )
    reward: RewardConfig = dataclasses.field(default_factory=RewardConfig)


@dataclasses.dataclass
class ObservationConfig:
    """How sensor readings become the state (thesis 4.2.4)."""

    variant: str = quantity(
        "exact", "", "of eq. 4.4 to 4.7", choices=("exact", "small_angle")
    )


@dataclasses.dataclass
class Scenario:
    """Everything that denotes one diagram."""

    name: str = "removal"
    simulation: SimulationConfig = dataclasses.field(default_factory=SimulationConfig)
    lock: LockConfig = dataclasses.field(default_factory=LockConfig)
    contact: ContactConfig = dataclasses.field(default_factory=ContactConfig)
    placement: PlacementConfig = dataclasses.field(default_factory=PlacementConfig)
    arm: ArmConfig = dataclasses.field(default_factory=ArmConfig)
    gripper: GripperConfig = dataclasses.field(default_factory=GripperConfig)
    ft_sensor: SensorConfig = dataclasses.field(default_factory=SensorConfig)
    twin: TwinConfig = dataclasses.field(default_factory=TwinConfig)
    task: TaskConfig = dataclasses.field(default_factory=TaskConfig)
    observation: ObservationConfig = dataclasses.field(
        default_factory=ObservationConfig
    )
    imprecision: float = quantity(0.0, "m", "psi of algorithm 3.2", low=0.0, high=0.01)
    effects: list[AnyEffect] = dataclasses.field(default_factory=list)


def scenario_path(name: str) -> Path:
    """Returns the file of a shipped scenario's name, or the path as given.

    Raises:
        DisasmError: neither a shipped scenario nor a file.
    """
    shipped = models_dir() / "scenarios"
    for path in (Path(name), shipped / f"{name}.yaml"):
        if path.is_file():
            return path
    names = sorted(p.stem for p in shipped.glob("*.yaml"))
    raise DisasmError(f"scenario {name}: no such file; {closest(name, names)}")


def load_scenario(name: str, overrides: Sequence[str] = ()) -> Scenario:
    """Returns the scenario of a file or shipped name, with `key=value` overrides.

    Raises:
        DisasmError: missing file, unknown key, bad value; says which and where.
    """
    path = scenario_path(name)
    scenario = _load(path.read_text(), Scenario(), str(path))
    for override in overrides:
        scenario = _override(scenario, override)
    try:
        check(scenario)
        _refuse_untagged(scenario)
        _refuse_broken_periods(scenario)
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}") from None
    return scenario


def _refuse_untagged(scenario: Scenario) -> None:
    for number, effect in enumerate(scenario.effects):
        if isinstance(effect, Untagged):
            names = ", ".join(effect.__name__ for effect in EFFECTS)
            raise DisasmError(
                f"effects.{number}: has no name; write `- !Name {{...}}`, "
                f"with one of {names}"
            )


def _refuse_broken_periods(scenario: Scenario) -> None:
    steps = {
        "simulation.cell_time_step": scenario.simulation.cell_time_step,
        "simulation.twin_time_step": scenario.simulation.twin_time_step,
        "arm.control_period": scenario.arm.control_period,
    }
    for name, step in steps.items():
        count = scenario.task.period / step
        if abs(count - round(count)) > 1e-6:
            raise DisasmError(
                f"{name}: task.period ({scenario.task.period:g} s) is not a whole "
                f"number of {step:g} s; give a divisor of it"
            )


def dump_scenario(scenario: Scenario) -> str:
    """Returns the scenario as YAML text that `load_scenario` reads back."""
    return yaml_dump_typed(scenario, schema=Scenario)


def scenario_to_mapping(scenario: Scenario) -> dict[str, Any]:
    """Returns the scenario as plain data, for a log's header.

    An effect is a mapping of its parameters with its name under `effect`.
    """
    mapping = dataclasses.asdict(scenario)
    mapping["effects"] = [
        {"effect": type(effect).__name__, **dataclasses.asdict(effect)}
        for effect in scenario.effects
    ]
    return mapping


def scenario_from_mapping(mapping: dict[str, Any]) -> Scenario:
    """Returns the scenario of what `scenario_to_mapping` gave.

    Raises:
        DisasmError: unknown key or effect.
    """
    plain = {key: value for key, value in mapping.items() if key != "effects"}
    scenario = _load(yaml.safe_dump(plain), Scenario(), "scenario of the log")
    lines = []
    for effect in mapping.get("effects", []):
        values = {key: value for key, value in effect.items() if key != "effect"}
        flow = yaml.safe_dump(values, default_flow_style=True, width=10**6).strip()
        lines.append(f"- !{effect['effect']} {flow}")
    if not lines:
        return scenario
    text = "\n".join(["effects:", *lines])
    return _load(text, scenario, "scenario of the log")


def _override(scenario: Scenario, override: str) -> Scenario:
    key, separator, value = override.partition("=")
    if not separator or not key:
        raise DisasmError(f"--set {override}: write it as key=value")
    keys = key.strip().split(".")
    if keys[0] == "effects" and len(keys) > 1:
        return _override_effect(scenario, keys[1:], value, override)
    text = value
    for part in reversed(keys):
        text = f"{{{part}: {text}}}"
    return _load(text, scenario, f"--set {override}")


def _override_effect(
    scenario: Scenario, keys: list[str], value: str, override: str
) -> Scenario:
    if len(keys) != 2 or not keys[0].isdigit() or int(keys[0]) >= len(scenario.effects):
        raise DisasmError(
            f"--set {override}: the scenario lists {len(scenario.effects)} effects; "
            "write effects.NUMBER.parameter=value, counting from 0"
        )
    effect = scenario.effects[int(keys[0])]
    changed = _load(f"{{{keys[1]}: {value}}}", effect, f"--set {override}")
    effects = list(scenario.effects)
    effects[int(keys[0])] = changed
    return dataclasses.replace(scenario, effects=effects)


def _load(text: str, defaults: Any, source: str) -> Any:
    """Returns `defaults` overlaid with strict YAML; errors become one line."""
    try:
        if yaml.compose(text) is None:
            raise DisasmError(f"{source}: is empty; see models/scenarios/removal.yaml")
        return yaml_load_typed(data=text, schema=type(defaults), defaults=defaults)
    except yaml.YAMLError as error:
        line = getattr(getattr(error, "problem_mark", None), "line", 0) + 1
        problem = getattr(error, "problem", "")
        raise DisasmError(f"{source}: line {line}: not YAML ({problem})") from None
    except (RuntimeError, ValueError, TypeError, AssertionError) as error:
        raise DisasmError(f"{source}: {_explain(text, defaults, error)}") from None


def _explain(text: str, defaults: Any, error: Exception) -> str:
    message = " ".join(str(error).split())
    unknown = re.search(r"fields \['(\w+)'", message)
    if unknown:
        key, line = unknown.group(1), _line_of(text, rf"\b{unknown.group(1)}\s*:")
        return f"{line}unknown key '{key}'; {closest(key, _all_keys(type(defaults)))}"
    tag = re.search(r"tag value '(\w+)'", message)
    if tag:
        names = [effect.__name__ for effect in EFFECTS]
        line = _line_of(text, f"!{tag.group(1)}")
        return f"{line}effect '{tag.group(1)}' does not exist; " + closest(
            tag.group(1), names
        )
    value = re.search(r"could not convert string to \w+: '(.*)'", message)
    if value:
        line = _line_of(text, re.escape(value.group(1)))
        return f"{line}'{value.group(1)}' is not a number; give one in SI units"
    return f"a value has the wrong shape ({message}); see models/scenarios/removal.yaml"


def _line_of(text: str, pattern: str) -> str:
    for number, line in enumerate(text.splitlines(), start=1):
        if re.search(pattern, line):
            return f"line {number}: "
    return ""


def _all_keys(schema: type) -> list[str]:
    keys: list[str] = []
    for field in dataclasses.fields(schema):
        keys.append(field.name)
        if isinstance(field.type, type) and dataclasses.is_dataclass(field.type):
            keys += _all_keys(field.type)
    if schema is Scenario:
        for effect in EFFECTS:
            keys += [f.name for f in dataclasses.fields(effect)]  # type: ignore[arg-type]
    return keys
