"""A trained policy's law, in NumPy as in torch."""

import copy
import dataclasses
import pickle
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

from drake_disasm.policies import (
    Admittance,
    LearnedPolicy,
    Network,
    Straight,
    TaskView,
    save_policy,
)
from drake_disasm.scenario import load_scenario
from tests.refusals import refused

MakeNetwork = Callable[..., Network]


@pytest.mark.parametrize("widths", [(12, 128, 128, 6), (12, 6), (3, 1, 2)])
def test_network_is_what_torch_computes(make_network, widths):
    torch = pytest.importorskip("torch")
    network = make_network(*widths)
    layers = []
    for weight, bias in zip(network.weights, network.biases, strict=True):
        layer = torch.nn.Linear(*weight.shape[::-1])
        layer.weight.data, layer.bias.data = map(torch.from_numpy, (weight, bias))
        layers += [layer, torch.nn.ReLU()]
    module = torch.nn.Sequential(*layers[:-1])
    for x in np.random.default_rng(1).normal(size=(20, widths[0])).astype(np.float32):
        with torch.inference_mode():
            expected = module(torch.from_numpy(x)).numpy()
        found = network(x)
        assert found.dtype == np.float32
        scale = max(1.0, float(np.abs(expected).max()))
        np.testing.assert_allclose(found, expected, atol=1e-6 * scale, rtol=0)


def test_network_remembers_nothing(make_network: MakeNetwork) -> None:
    """Its working memory is not what it hands out, and no call colours the next."""
    network = make_network(12, 9, 6)
    a, b = np.random.default_rng(0).normal(size=(2, 12)).astype(np.float32)
    first = network(a)
    kept, given = first.copy(), a.copy()
    network(np.full(12, np.nan, np.float32))
    network(b)
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(network(a), kept)
    np.testing.assert_array_equal(a, given)
    pickled = pickle.loads(pickle.dumps(network))
    for twin in (copy.deepcopy(network), copy.copy(network), pickled):
        network(b)
        np.testing.assert_array_equal(twin(a), kept)


@pytest.mark.parametrize("base", [None, Admittance()])
def test_policy_is_its_formula(make_network, base):
    scale, reach = np.linspace(0.01, 5.0, 12), np.linspace(1e-4, 3e-3, 6)
    policy = LearnedPolicy(make_network(12, 8, 6), TaskView(scale, reach, base))
    for s in np.random.default_rng(2).normal(size=(5, 12)):
        chosen = np.tanh(policy.network((s / scale).astype(np.float32)))
        expected = reach * chosen + (0.0 if base is None else base(s))
        action = policy(s)
        assert action.dtype == np.float64
        np.testing.assert_array_equal(action, expected)
        np.testing.assert_array_equal(policy.normalised(s), chosen)
        np.testing.assert_array_equal(policy.to_action(s, chosen), expected)


@pytest.mark.parametrize("base", [None, Admittance()])
def test_choice_comes_back_from_its_action(base: Admittance | None) -> None:
    mapping = TaskView(
        np.ones(12), np.array([1e-3, 2e-3, 1e-3, 0.01, 0.01, 0.02]), base
    )
    generator = np.random.default_rng(3)
    for _ in range(20):
        s, chosen = generator.normal(size=12), generator.uniform(-1, 1, 6)
        back = mapping.from_action(s, mapping.to_action(s, chosen))
        assert back.dtype == np.float32
        np.testing.assert_allclose(back, chosen, atol=1e-6)
    # What is out of reach becomes the nearest choice.
    reach = np.array([1e-3, 1e-3, 0.0, 0.1, 0.1, 0.1])
    mapping = TaskView(np.ones(12), reach, Straight(speed=1e-3))
    choice = mapping.from_action(np.zeros(12), np.array([1.0, -1.0, 0.5, 0, 0.05, 0]))
    np.testing.assert_allclose(choice, [1, -1, 0, 0, 0.5, 0])


TORCHLESS = """
import sys
from pathlib import Path
sys.modules["torch"] = None  # any import of it fails
from drake_disasm.policies import load_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
simulation = TaskSimulation(
    load_scenario("chapter3"), "twin", load_policy(Path(sys.argv[1]))
)
simulation.reset(0)
simulation.step()
assert simulation.action().any()
assert not any(name.startswith("torch.") for name in sys.modules)
"""


def test_policy_runs_without_torch(policy: LearnedPolicy, tmp_path) -> None:
    save_policy(tmp_path / "p.npz", policy)
    command = [sys.executable, "-c", TORCHLESS, str(tmp_path / "p.npz")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def _described(policy: LearnedPolicy, **changes: object) -> LearnedPolicy:
    description = dataclasses.replace(policy.description, **changes)
    return dataclasses.replace(policy, description=description)


@pytest.mark.parametrize(("changes", "override", "words"), [
    ({"period": 0.05}, "", ["task.period", "0.05", "0.1"]),
    ({}, "task.period=0.2", ["task.period", "0.2", "set task.period=0.1"]),
    ({}, "observation.variant=small_angle", ["observation.variant", "exact", "small"]),
    ({"max_translation": 0.004}, "", ["task.max_translation", "0.004", "0.003"]),
    ({}, "task.max_rotation=0.01", ["task.max_rotation", "0.01", "0.0174533"]),
    ({"state_names": ("x", "y")}, "", ["state", "('x', 'y')", "train anew"]),
    ({"action_names": ("dx",)}, "", ["action", "('dx',)", "train anew"]),
])  # fmt: skip
def test_policy_of_another_task_is_refused(policy, changes, override, words):
    scenario = load_scenario("chapter4", [override] if override else [])
    with refused("chapter4", *words):
        _described(policy, **changes).check_fits(scenario)


def test_policy_carries_over_to_other_locks_errors_and_wider_bounds(policy):
    overrides = ["part.clearance=0.0003", "effects=[!SensorBias {fx: 0.5}]"]
    overrides += ["task.max_translation=0.005", "task.max_rotation=0.05"]
    overrides += ["task.steps=200", "imprecision=0.0003"]
    policy.check_fits(load_scenario("chapter4", overrides))
