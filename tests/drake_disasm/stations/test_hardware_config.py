"""The file of --hardware-config: the shipped one is read, mistakes are named."""

from pathlib import Path

import pytest

from drake_disasm.common.resources import models_dir
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import load_scenario, shipped_scenarios
from drake_disasm.stations.hardware_config import (
    load_hardware_config,
    refuse_narrow_guard,
)
from tests.refusals import refused


def test_the_shipped_file_is_read() -> None:
    config = load_hardware_config(models_dir() / "hardware" / "cell.yaml")
    assert config.gripper.device_id == 9 and config.ft_sensor.port == 49152
    assert config.safety.stale_after("gripper") == 0.5


@pytest.mark.parametrize(("text", "words"), [
    ("safety: {max_forc: 10}", "did you mean 'max_force'"),
    ("safety: {max_force: 30}", "safety.max_force"),
    ("gripper: {transport: usb}", "gripper.transport"),
    ("ft_sensor: {port: abc}", "line 1"),
    ("", "is empty"),
    ("ft_sensor: {port: 70000}", "ft_sensor.port"),
    ("ft_sensor: {port: -1}", "ft_sensor.port"),
    (f"gripper: {{address: {'a' * 600}}}", "gripper.address"),
    ('iiwa: {lcm_url: "udpm://\\0"}', "iiwa.lcm_url"),
])  # fmt: skip
def test_a_mistake_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(text)
    with refused(words):
        load_hardware_config(path)
    with refused("copy models/hardware/cell.yaml"):
        load_hardware_config(tmp_path / "none.yaml")


def test_the_shipped_guard_lets_the_shipped_tasks_decide() -> None:
    for name in shipped_scenarios():
        refuse_narrow_guard(load_scenario(name), SafetyConfig())
    # One within a task's workspace is refused.
    for low, high, words in (
        ([-0.012] * 3, [0.070, 0.03, 0.01], "safety.workspace_high.0: 0.07 m"),
        ([-0.012, -0.009, -0.01], [0.08, 0.03, 0.01], "safety.workspace_low.1: -0.009"),
    ):
        limits = SafetyConfig(workspace_low=low, workspace_high=high)
        with refused(words):
            refuse_narrow_guard(load_scenario("removal"), limits)
