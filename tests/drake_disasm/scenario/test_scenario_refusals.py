"""Ways to get a scenario wrong: one line with file, key and remedy for each."""

from pathlib import Path

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import load_scenario, scenario_from_mapping
from drake_disasm.stations import make_station
from tests.refusals import refused

_K = "arm: {cartesian_impedance: {stiffness: [%s]}}"
#: What stands in a file, and what is said about it.
BAD = {
    "part: !DoorChain {clearence: 1e-4}": ["line 1", "'clearence'", "'clearance'"],
    "part: !DoorChain {clearance: 0}": ["part.clearance", "0.0001 to 0.001"],
    "part: !DoorChain {clearance: 0.3 mm}": ["line 1", "'0.3 mm'", "number"],
    "part: !DoorChain {clearance: .nan}": ["part.clearance", "nan"],
    "part: !DoorChain {clearance: true}": ["clearance"],
    "part: !DoorChain {clearance: [1]}": ["wrong shape", "clearance"],
    "part: 3": ["line 1", "part", "no name"],
    "part:": ["part"],
    "1: 2": [],
    "part: !DoorChain {clearance": ["line 1", "not YAML"],
    "part: !DoorChain {clearance: 0.0003}\npart: !DoorChain {travel: 0.05}": [],
    "part: !DoorChain {clearance: 0.0003}\ncontact:\n  clearance: 0.0003\n": ["line 3"],
    "part: " + "{clearance: " * 5000: ["nested deeper"],
    f"part: !DoorChain {{clearance: {10**400}}}": ["part.clearance"],
    "clearance: 0.0003": ["part"],
    "effects:": ["effects"],
    "effects: [!GroovePose {ry: 1}]": ["effects.0.ry", "-0.2 to 0.2"],
    "effects: [{}]": ["effects.0", "no name", "GroovePose"],
    "effects: [!SensorBias {}, !SensorBias {fx: .nan}]": ["effects.1.fx"],
    "effects: [!SensorBias {f_x: 1}]": ["'f_x'"],
    f"effects: [{'!SensorBias {fx: 0.1}, ' * 200}]": ["effects: 200 values"],
    "name: a\neffects: [!GroovePos {ry: 1}]": ["line 2", "'GroovePos'", "'GroovePose'"],
    "name: 3": ["name"],
    "name: " + "x" * 600: ["longer than 500 characters"],
    'name: "a\\x07b"': ["not printable"],
    "placement: {p_WG: [1, 2]}": ["placement.p_WG", "2 values", "3"],
    "arm: {name: ft_sensor}": ["arm.name: 'ft_sensor'", "another device's"],
    "arm: {name: my arm}": ["arm.name: 'my arm'", "letters, digits"],
    f"arm: {{posture: [{'0, ' * 900}]}}": ["arm.posture: 900 values"],
    "arm: {control: torque}": ["arm.control", "'torque'", "cartesian_impedance"],
    "arm: {joint_impedance: {damping_ratio: 0}}": ["damping_ratio: 0", "0.1 to 1"],
    "arm: {joint_impedance: {stiffness: [1, 9, 9, 9, 9, 9, 6000]}}": [
        "arm.joint_impedance.stiffness: 1 N m/rad",
        "10 to 5000",
    ],
    _K % "2e3, 2e3, 6e3, 2e2, 2e2, 2e2": ["stiffness: 6000", "1 to 5000"],
    _K % "2e3, 5, 2e3, 2e2, 2e2, 2e2": ["5 N/m along y", "10 to 5000"],
    _K % "2e3, 2e3, 2e3, 2e2, 2e2, 301": ["301 N m/rad about z", "1 to 300"],
    "gripper: {hold: yes}": ["hold"],
    "ft_sensor: {noise: [-1, 0, 0, 0, 0, 0]}": ["ft_sensor.noise"],
    "simulation: {cell_time_step: 0.003}": ["cell_time_step", "divisor"],
    "task: {period: 0.1234}": ["task.period"],
    "task: {steps: 1.5}": ["steps"],
    "": ["is empty"],
    "\xff\xfe\x00name": [],
    "name: x\n" * 100_000: ["more than 0.25 MiB"],
}


@pytest.mark.parametrize("text", BAD, ids=[text[:40] for text in BAD])
def test_a_bad_file_is_one_line(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_bytes(text.encode("latin-1"))
    with refused(f"{file}: ", *BAD[text]):
        load_scenario(str(file))


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b", "/dev/zero", "/tmp", ""])
def test_a_name_of_no_file_is_one_short_line(name: str) -> None:
    with pytest.raises(DisasmError, match=r"no such file; ") as caught:
        load_scenario(name)
    assert len(str(caught.value)) < 600


#: An override, and what is said about it besides itself.
BAD_SETS = {
    "": "key=value",
    "=3": "",
    "part.clearance": "key=value",
    "part.clearance={": "",
    "part.clearnce=1": "'clearance'",
    "lock..clearance=3": "",
    "part.clearance.x=3": "",
    "task.reward=3": "",
    "effects.0=3": "",
    "effects.-1.ry=1": "",
    "effects.5.ry=0": "lists 1 effects",
    "effects.0.ry=": "",
    "effects.0.ry=0.5": "out of range; give a value",
    "effects.².ry=0.1": "",
}


@pytest.mark.parametrize("override", BAD_SETS)
def test_a_bad_override_is_one_line(override: str) -> None:
    with refused(override, BAD_SETS[override]):
        load_scenario("removal_turned", [override])


IMPOSSIBLE = {
    "part.head_diameter=0.0053": ["part.head_diameter: ", "slips through the slot"],
    "part.neck_diameter=0.012": ["part.head_diameter: ", "slips through the slot"],
    "part=!DoorChain {head_diameter: 0.03, travel: 0.03}": ["part.travel: ", "no lips"],
    "task.room=[0, 0.01, 0.01]": ["task.room: ", "out of range"],
    "part.travel=0.05": ["task.travel_success: ", "never reached"],
    "gripper.stiffness=[600, 600, 0, 10, 10, 10]": ["gripper.stiffness"],
    "gripper.stiffness=[600, 600, -5, 10, 10, 10]": ["gripper.stiffness"],
    "gripper.damping_ratio=0": ["gripper.damping_ratio"],
    "gripper.compliance=soft": ["adaptive"],
}


@pytest.mark.parametrize("override", IMPOSSIBLE)
def test_what_cannot_be_is_refused(override: str) -> None:
    with refused(override, *IMPOSSIBLE[override]):
        load_scenario("chapter3", [override])


def test_a_scenario_made_in_code_is_checked_too() -> None:
    scenario = load_scenario("removal")
    scenario.part.clearance = 0.0
    with refused("part.clearance"):
        make_station("twin", scenario)


@pytest.mark.parametrize("mapping", [
    {"effects": [{"effect": "Magic"}]},
    {"effects": [{"fx": 1.0}]},
    {"colour": "red"},
    {"effects": 3},
    {"effects": ["SensorBias"]},
    {"effects": [{"effect": ["SensorBias"]}]},
    {"effects": [{"effect": "SensorBias {}\n- !SensorBias"}]},
    {1: 2},
])  # fmt: skip
def test_a_logs_scenario_is_checked_too(mapping: dict) -> None:
    with pytest.raises(DisasmError, match=r"^scenario of the log: |is not registered"):
        scenario_from_mapping(mapping)


def test_later_overrides_win_and_leave_the_rest_of_their_section() -> None:
    overrides = [
        "part.clearance=2e-4",
        "part=!DoorChain {clearance: 3e-4, travel: 0.05}",
    ]
    scenario = load_scenario("removal", [*overrides, "task.reward.w_f=0.25"])
    assert (scenario.part.clearance, scenario.part.travel) == (3e-4, 0.05)
    assert (scenario.task.reward.w_f, scenario.task.reward.w_dis) == (0.25, 1.6)
