"""Learned functions, their files, and the effects that apply them."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm import effects as ef
from drake_disasm.effects.learned import LearnedFunctions
from drake_disasm.scenario import Scenario, dump_scenario, load_scenario
from drake_disasm.scenario.validity import validate
from tests.drake_disasm.effects.learned_files import HEIGHT, step_above_zero, step_in_fy
from tests.refusals import refusal


def test_a_tree_is_followed_and_comes_back_from_its_file(tmp_path: Path) -> None:
    inputs = np.array([[-1.0, 0.0], [0.5, 0.0], [0.5, 9.0], [0.0, 0.0]])
    found = step_above_zero(2, 0, -2.0, 2.0)(inputs)
    np.testing.assert_array_equal(found, [0.0, HEIGHT, 0.0, 0.0])
    path = step_in_fy(tmp_path)
    found = LearnedFunctions.load(path)
    assert found.inputs == ef.SensorResidualModel.inputs
    inputs = np.random.default_rng(0).uniform(-9, 9, (50, 10))
    np.testing.assert_array_equal(
        found.outputs["fy"](inputs), step_above_zero(10, 0, -20.0, 20.0)(inputs)
    )


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
def test_a_reading_gets_what_was_learned(shape: tuple, tmp_path: Path) -> None:
    effect = ef.SensorResidualModel(str(step_in_fy(tmp_path)), share=0.5)
    R_WS = np.broadcast_to(np.eye(3), (*shape, 3, 3))
    sensing = ef.Sensing(np.ones(shape), R_WS, np.array([0.0, 0.0, -9.81]))
    wrench = np.full((*shape, 6), 3.0)
    added = effect.apply(wrench, sensing) - wrench
    expected = [0.0, 0.5 * HEIGHT, 0.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(added, np.broadcast_to(expected, wrench.shape))
    late = ef.Sensing(np.full(shape, 99.0), R_WS, sensing.g_W)
    np.testing.assert_array_equal(effect.apply(wrench, late), wrench)


def test_a_joint_gets_what_was_learned(tmp_path: Path) -> None:
    """Each with its own share, as where many parameter sets are simulated at once."""
    path = tmp_path / "model.npz"
    outputs = {"b": step_above_zero(4, 1, -5.0, 5.0)}
    LearnedFunctions(ef.ArmResidualModel.inputs, outputs).save(path)
    v = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 5, 2))
    zero, share = np.zeros_like(v), np.linspace(0.0, 1.0, 5)
    effect = ef.ArmResidualModel(str(path), share=share)
    found = effect.torques(ef.ArmSamples(("a", "b"), zero, v, zero, zero))
    np.testing.assert_array_equal(found[..., 1], share * HEIGHT * (v[..., 1] > 0.0))
    assert not found[..., 0].any()


def test_a_scenario_finds_the_file_beside_it(tmp_path: Path) -> None:
    step_in_fy(tmp_path)
    effects = [ef.SensorResidualModel("model.npz", share=1.0)]
    (tmp_path / "own.yaml").write_text(dump_scenario(Scenario(effects=effects)))
    found = load_scenario(str(tmp_path / "own.yaml"))
    assert found.effects[0].file == str(tmp_path / "model.npz")
    (tmp_path / "model.npz").unlink()
    message = refusal(load_scenario, str(tmp_path / "own.yaml"))
    assert "effects.0.file: " in message and "no such file" in message


def test_without_share_no_file_is_needed() -> None:
    null = ef.SensorResidualModel("gone.npz")
    validate(Scenario(effects=[null]))
    wrench, at_rest = np.arange(6.0), ef.Sensing(np.zeros(()), np.eye(3), np.zeros(3))
    np.testing.assert_array_equal(null.apply(wrench, at_rest), wrench)


def test_what_is_no_such_file_or_for_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "model.npz"
    np.savez(path, inputs=np.array([print], dtype=object))  # pickled, would run code
    for content in (path.read_bytes(), b"no archive"):
        path.write_bytes(content)
        message = refusal(LearnedFunctions.load, path)
        assert "can't be read" in message and "; name the file" in message
    effect = ef.ArmResidualModel(str(step_in_fy(tmp_path)), share=1.0)
    zero = np.zeros((1, 1))
    samples = ef.ArmSamples(("a",), zero, zero, zero, zero)
    assert "its functions take fx, " in refusal(effect.torques, samples)
