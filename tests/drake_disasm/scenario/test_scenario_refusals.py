"""More ways to get a scenario wrong: one line with file, key and remedy for each."""

import time
from pathlib import Path

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario import load_scenario, scenario_from_mapping
from drake_disasm.stations import make_station


def _refusal(file: Path) -> str:
    with pytest.raises(DisasmError) as caught:
        load_scenario(str(file))
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(file))
    return message.removeprefix(str(file))


BAD = {
    "lock: {clearence: 1e-4}": ["line 1", "'clearence'", "'clearance'"],
    "lock: {clearance: 0}": ["lock.clearance", "0.0001 to 0.001"],
    "lock: {clearance: abc}": ["line 1", "'abc'", "number"],
    "lock: {clearance: .nan}": ["lock.clearance", "nan"],
    "lock: {clearance: [1]}": ["wrong shape", "clearance"],
    "lock: 3": ["line 1", "lock", "not a section"],
    "name: a\neffects: [!GroovePos {ry: 1}]": ["line 2", "'GroovePos'", "'GroovePose'"],
    "effects: [!GroovePose {ry: 1}]": ["effects.0.ry", "-0.2 to 0.2"],
    "effects: [{}]": ["effects.0", "no name", "GroovePose"],
    "arm: {posture: [1, 2]}": ["arm.posture", "2 values", "7"],
    "arm: {control: torque}": ["arm.control", "'torque'", "cartesian_impedance"],
    "arm: {joint_impedance: {damping_ratio: 0}}": ["damping_ratio: 0", "0.1 to 1"],
    "arm: {joint_impedance: {stiffness: [1, 9, 9, 9, 9, 9, 6000]}}": [
        "arm.joint_impedance.stiffness: 1 N m/rad",
        "10 to 5000",
    ],
    "arm: {cartesian_impedance: {damping_ratio: 0}}": ["damping_ratio: 0", "0.1 to 1"],
    "arm: {cartesian_impedance: {stiffness: [2e3, 2e3, 6e3, 2e2, 2e2, 2e2]}}": [
        "arm.cartesian_impedance.stiffness: 6000",
        "1 to 5000",
    ],
    "arm: {cartesian_impedance: {stiffness: [2e3, 5, 2e3, 2e2, 2e2, 2e2]}}": [
        "arm.cartesian_impedance.stiffness: 5 N/m along y",
        "10 to 5000",
    ],
    "arm: {cartesian_impedance: {stiffness: [2e3, 2e3, 2e3, 2e2, 2e2, 301]}}": [
        "arm.cartesian_impedance.stiffness: 301 N m/rad about z",
        "1 to 300",
    ],
    "gripper: {hold: glue}": ["gripper.hold", "'glue'", "friction"],
    "simulation: {cell_time_step: 0.003}": ["cell_time_step", "divisor"],
    "lock: {clearance": ["line 1", "not YAML"],
    "": ["is empty"],
}


@pytest.mark.parametrize("text", BAD)
def test_bad_file_is_one_line(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    message = _refusal(file)
    assert all(word in message for word in BAD[text]), message


NAMED = {
    "task: {steps: 1.5}": "steps",
    "task: {steps: true}": "steps",
    "task: {steps: many}": "many",
    "lock: {clearance: true}": "clearance",
    "lock: {clearance: 0.3 mm}": "0.3 mm",
    "lock: {clearance: .inf}": "lock.clearance",
    "lock: {clearance: }": "clearance",
    "arm: {posture: [0, 0, 0, 0, 0, 0, .nan]}": "arm.posture",
    "arm: {posture: []}": "arm.posture",
    "ft_sensor: {noise: [-1, 0, 0, 0, 0, 0]}": "ft_sensor.noise",
    "gripper: {hold: yes}": "hold",
    "name: 3": "name",
    "effects: [!SensorBias {fx: .nan}]": "effects.0.fx",
    "effects: [!SensorBias {}, !SensorBias {fx: 51}]": "effects.1.fx",
    "effects: [!SensorBias {f_x: 1}]": "'f_x'",
    "effects: [!SensorBias {fx: abc}]": "'abc'",
    "effects: [!Untagged {}]": "effects.0",
    "task: {period: 0.1234}": "task.period",
    "lock: *nothing": "nothing",
    "name: a\n---\nname: b": "line 2",
    "lock:\n\tclearance: 1": "line 2",
    "# only a comment": "empty",
    "name: !!python/object/apply:os.getcwd []": "line 1",
    f"task: {{steps: {10**400}}}": "task.steps",
    f"lock: {{clearance: {10**400}}}": "lock.clearance",
    f"task: {{steps: {'9' * 5000}}}": "task.steps",
    f"arm: {{posture: [{'0, ' * 900}]}}": "arm.posture: 900 values",
    f"effects: [{'!SensorBias {fx: 0.1}, ' * 200}]": "effects: 200 values",
    "name: " + "x" * 600: "longer than 500 characters",
    'name: "a\\x07b"': "not printable",
    "lock: " + "[" * 5000: "nested deeper",
    "lock: " + "{clearance: " * 5000: "nested deeper",
    "arm: {posture: [" + "0, " * 20_000 + "]}": "more than 10000 values",
    "lock: &a {clearance: *a}": "within itself",
}


@pytest.mark.parametrize("text", NAMED)
def test_what_is_wrong_is_named(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    assert NAMED[text] in _refusal(file)


EMPTY_OR_SCALAR = {"lock:": "lock", "lock: 3": "lock", "effects:": "effects"}


@pytest.mark.parametrize("text", EMPTY_OR_SCALAR)
def test_a_section_without_content_is_named(text: str, tmp_path: Path) -> None:
    """As when everything below it has been commented out."""
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    assert EMPTY_OR_SCALAR[text] in _refusal(file)


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b", "/dev/zero", "/tmp", ""])
def test_a_name_of_no_file_is_one_short_line(name: str) -> None:
    with pytest.raises(DisasmError, match=r"no such file; ") as caught:
        load_scenario(name)
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("size", [10**6, 9 * 10**6])
def test_a_large_file_is_refused_before_it_is_parsed(size: int, tmp_path: Path) -> None:
    """Nine megabytes took 39 s."""
    file = tmp_path / "mine.yaml"
    file.write_text("name: x\n" * (size // 8))
    begun = time.process_time()
    assert "more than 0.25 MiB" in _refusal(file)
    assert time.process_time() - begun < 0.5


def test_not_text_is_one_line(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_bytes(b"\xff\xfe\x00name")
    _refusal(file)


@pytest.mark.parametrize("text", ["1: 2", "? \n: 3", "lock: {1: 2}"])
def test_a_key_that_is_no_word_is_one_line(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    _refusal(file)


@pytest.mark.parametrize(
    "text",
    [
        "lock: {clearance: 0.0003, clearance: 0.0005}",
        "lock: {clearance: 0.0003}\nlock: {travel: 0.05}",
    ],
)
def test_a_key_given_twice_is_refused(text: str, tmp_path: Path) -> None:
    """Else the first is ignored without a word (YAML 1.2 asks for unique keys)."""
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    _refusal(file)


def test_a_key_in_the_wrong_section_is_sent_to_the_right_one(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("clearance: 0.0003")
    message = _refusal(file)
    assert "lock" in message, message


def test_the_line_is_that_of_the_wrong_key(tmp_path: Path) -> None:
    """Not of the first key of that name, which is right where it is."""
    file = tmp_path / "mine.yaml"
    file.write_text("lock: {clearance: 0.0003}\ncontact:\n  clearance: 0.0003\n")
    assert "line 3" in _refusal(file)


BAD_SETS = {
    "lock.clearance": "key=value",
    "lock.clearance=x": "number",
    "lock.clearnce=1": "'clearance'",
    "effects.0.ry=0.1": "lists 0 effects",
}


@pytest.mark.parametrize("override", BAD_SETS)
def test_bad_override_names_the_remedy(override: str) -> None:
    with pytest.raises(DisasmError, match=BAD_SETS[override]) as caught:
        load_scenario("removal", [override])
    assert "\n" not in str(caught.value)
    assert override in str(caught.value)


@pytest.mark.parametrize(
    "override",
    ["", "=", "=3", "lock", "lock=", "lock.clearance=", "lock..clearance=3",
     "lock.clearance={", "lock.clearance.x=3", "task.reward=3", "effects=3",
     "effects.0=3", "effects.-1.ry=1", "effects.5.ry=0", "effects.0.rq=1",
     "effects.0.ry=", "effects.0.ry=abc", "effects.².ry=0.1", "nothing.x=1"],
)  # fmt: skip
def test_bad_override_is_one_line(override: str) -> None:
    with pytest.raises(DisasmError) as caught:
        load_scenario("removal_turned", [override])
    message = str(caught.value)
    assert f"--set {override}" in message and "\n" not in message


@pytest.mark.parametrize("override", ["effects.0.ry=0.5", "lock.clearance=0"])
def test_override_out_of_range_names_key_and_range(override: str) -> None:
    key = override.split("=")[0]
    with pytest.raises(DisasmError, match=rf"{key}: .* out of range; give a value"):
        load_scenario("removal_turned", [override])


IMPOSSIBLE = {
    "lock.head_diameter=0.0053": "lock.head_diameter: .* slips through the slot",
    "lock.neck_diameter=0.012": "lock.head_diameter: .* slips through the slot",
    "lock={head_diameter: 0.03, travel: 0.03}": "lock.travel: .* no lips",
    "task.room=[0, 0.01, 0.01]": "task.room: .* out of range",
    "lock.travel=0.05": "task.travel_success: .* never reached",
}


@pytest.mark.parametrize("override", IMPOSSIBLE)
def test_what_cannot_be_is_refused(override: str) -> None:
    with pytest.raises(DisasmError, match=IMPOSSIBLE[override]) as caught:
        load_scenario("chapter3", [override])
    assert override in str(caught.value) and "\n" not in str(caught.value)


def test_a_scenario_made_in_code_is_checked_too() -> None:
    scenario = load_scenario("removal")
    scenario.lock.clearance = 0.0
    with pytest.raises(DisasmError, match=r"lock\.clearance"):
        make_station("twin", scenario)


@pytest.mark.parametrize(
    "mapping",
    [
        {"lock": {"clearance": -1}},
        {"effects": [{"effect": "Magic"}]},
        {"effects": [{"fx": 1.0}]},
        {"colour": "red"},
        {"effects": 3},
        {"effects": ["SensorBias"]},
        {"effects": [{"effect": ["SensorBias"]}]},
        {"effects": [{"effect": "SensorBias {}\n- !SensorBias"}]},
        {1: 2},
    ],
)
def test_a_logs_scenario_is_checked_too(mapping: dict) -> None:
    with pytest.raises(DisasmError, match=r"^scenario of the log: |is not registered"):
        scenario_from_mapping(mapping)


def test_later_overrides_win() -> None:
    overrides = ["lock.clearance=2e-4", "lock={clearance: 3e-4, travel: 0.05}"]
    scenario = load_scenario("removal", overrides)
    assert (scenario.lock.clearance, scenario.lock.travel) == (3e-4, 0.05)


def test_override_leaves_the_rest_of_its_section() -> None:
    scenario = load_scenario("chapter3", ["task.reward.w_f=0.25"])
    assert scenario.task.reward.w_f == 0.25
    assert scenario.task.reward.w_dis == 0.6
    assert scenario.task.success == "travelled"
