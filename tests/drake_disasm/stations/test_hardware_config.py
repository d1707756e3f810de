"""The file of --hardware-config: the shipped one is read, mistakes are named."""

from pathlib import Path

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.resources import models_dir
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import load_scenario, shipped_scenarios
from drake_disasm.stations.hardware_config import (
    load_hardware_config,
    refuse_narrow_guard,
)


def test_the_shipped_file_is_read() -> None:
    config = load_hardware_config(models_dir() / "hardware" / "cell.yaml")
    assert config.gripper.device_id == 9 and config.ft_sensor.port == 49152
    assert config.safety.stale_after("gripper") == 0.5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("safety: {max_forc: 10}", "did you mean 'max_force'"),
        ("safety: {max_force: 30}", "safety.max_force"),
        ("safety: {max_force: .nan}", "safety.max_force"),
        ("gripper: {transport: usb}", "gripper.transport"),
        ("ft_sensor: {port: abc}", "line 1"),
        ("", "is empty"),
        ("ft_sensor: {port: 70000}", "ft_sensor.port"),
        ("ft_sensor: {port: -1}", "ft_sensor.port"),
        (f"gripper: {{address: {'a' * 600}}}", "gripper.address"),
        ('iiwa: {lcm_url: "udpm://\\0"}', "iiwa.lcm_url"),
        ("gripper: {address: [1, 2]}", "gripper.address"),
        ("gripper: " + "[" * 5000, "nested deeper"),
        ("#" * 300_000, "more than 0.25 MiB"),
    ],
)
def test_a_mistake_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(text)
    with pytest.raises(DisasmError) as caught:
        load_hardware_config(path)
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_a_missing_file_says_what_to_copy(tmp_path: Path) -> None:
    with pytest.raises(DisasmError, match=r"copy models/hardware/cell\.yaml"):
        load_hardware_config(tmp_path / "none.yaml")


@pytest.mark.parametrize("name", shipped_scenarios())
def test_the_shipped_guard_lets_the_shipped_tasks_decide(name: str) -> None:
    refuse_narrow_guard(load_scenario(name), SafetyConfig())


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        ([-0.012] * 3, [0.070, 0.03, 0.01], "safety.workspace_high.0: 0.07 m"),
        ([-0.012, -0.009, -0.01], [0.08, 0.03, 0.01], "safety.workspace_low.1: -0.009"),
    ],
)
def test_a_guard_within_the_tasks_workspace_is_refused(
    low: list[float], high: list[float], words: str
) -> None:
    limits = SafetyConfig(workspace_low=low, workspace_high=high)
    with pytest.raises(DisasmError) as caught:
        refuse_narrow_guard(load_scenario("removal"), limits)
    assert words in str(caught.value) and "\n" not in str(caught.value)
