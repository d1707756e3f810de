"""A task in the axes of its part's stages."""

import dataclasses

import numpy as np
import pytest
import torch

from drake_disasm.common.arrays import to_numpy
from drake_disasm.policies import (
    Admittance,
    LearnedPolicy,
    StageAxes,
    TaskView,
    TaskViews,
    make_policy,
    resolve_policy,
    save_policy,
)
from drake_disasm.scenario import load_scenario
from tests.refusals import refused

CHAIN = StageAxes("xy", (0.06, 0.004), 0.055)
BAYONET = StageAxes("vy", (1.0, 0.01), 0.95)


def _state(**values: float) -> np.ndarray:
    state, names = np.zeros(12), ["x", "y", "z", "u", "v", "w", "fx", "fy", "fz"]
    for name, value in values.items():
        state[names.index(name)] = value
    return state


def test_agent_sees_what_is_left_of_the_stage_and_forces_along_it() -> None:
    seen = CHAIN.observe(_state(x=0.02, z=0.003, fx=-2.0, fy=1.0))
    np.testing.assert_allclose(seen, [0.04, 0, 0.003, 0, 0, 0, -2, 1, 0, 0, 0, 0])
    seen = CHAIN.observe(_state(x=0.058, y=0.001, fx=-2.0, fy=1.0))
    np.testing.assert_allclose(seen, [0.003, 0, 0.058, 0, 0, 0, 1, 0, -2, 0, 0, 0])


def test_a_turn_is_left_about_the_first_axis() -> None:
    seen = BAYONET.observe(_state(v=0.3, y=0.001, fz=5.0))
    np.testing.assert_allclose(seen, [0.001, 0, 0, 0.7, 0, 0, 0, 5, 0, 0, 0, 0])
    action = BAYONET.to_groove(_state(v=0.3), np.array([1.0, 2, 3, 4, 5, 6]))
    np.testing.assert_allclose(action, [3, 1, 2, 6, 4, 5])


@pytest.mark.parametrize("axis", range(6))
def test_parts_that_differ_in_their_axis_look_the_same(axis: int) -> None:
    """A state, and the same about another axis: the agent can't tell them apart."""
    state, action = np.random.default_rng(0).normal(size=(2, 12))
    first, own = ("x", "u")[axis // 3], "xyzuvw"[axis]
    turned = np.roll(state.reshape(4, 3), axis % 3, axis=1).ravel()
    here, there = StageAxes(first, (0.5,), 0.4), StageAxes(own, (0.5,), 0.4)
    np.testing.assert_allclose(there.observe(turned), here.observe(state))
    moved = there.to_groove(turned, action[:6])
    expected = np.roll(here.to_groove(state, action[:6]).reshape(2, 3), axis % 3, 1)
    np.testing.assert_allclose(moved, expected.ravel())


@pytest.mark.parametrize("axes", [CHAIN, BAYONET])
def test_choices_come_back_and_tensors_are_as_arrays(axes: StageAxes) -> None:
    random = np.random.default_rng(1)
    view = TaskView(np.full(12, 2.0), random.uniform(1, 2, 6), Admittance(), axes)
    states, chosen = random.normal(size=(9, 12)), random.uniform(-1, 1, (9, 6))
    actions = view.to_action(states, chosen)
    np.testing.assert_allclose(view.from_action(states, actions), chosen, atol=1e-6)
    tensors = torch.as_tensor(states), torch.as_tensor(chosen)
    np.testing.assert_allclose(to_numpy(view.to_action(*tensors)), actions)
    seen = to_numpy(view.observe(tensors[0]))
    np.testing.assert_allclose(seen, view.observe(states))
    placed = view.placed(torch.as_tensor)
    of_float32 = placed.to_action(tensors[0], tensors[1].float())
    assert of_float32.dtype == torch.float64
    np.testing.assert_allclose(to_numpy(of_float32), actions, rtol=1e-6)
    bare = dataclasses.replace(placed, base=None)
    assert bare.to_action(tensors[0], tensors[1].float()).dtype == torch.float64


def test_rows_of_several_tasks_have_the_view_of_their_own() -> None:
    views = [TaskView(np.ones(12), np.ones(6), None, axes) for axes in (CHAIN, BAYONET)]
    states, chosen = np.random.default_rng(2).normal(size=(2, 4, 12))
    chosen = chosen[:, :6]
    for count in (4, 3, 1):  # a last round may not fill all rows
        both, rows = TaskViews(views, 2), slice(count)
        seen = both.observe(states[rows])
        acted = both.to_action(states[rows], chosen[rows])
        for row in range(count):
            own = views[row // 2]
            np.testing.assert_array_equal(seen[row], own.observe(states[row]))
            expected = own.to_action(states[row], chosen[row])
            np.testing.assert_array_equal(acted[row], expected)


def test_policy_in_stage_axes_acts_on_any_part(policy: LearnedPolicy, tmp_path) -> None:
    scenario = load_scenario("iiwa_bayonet")
    view = dataclasses.replace(policy.view, base=Admittance(), axes=CHAIN)
    description = dataclasses.replace(policy.description, max_translation=0.001)
    policy = dataclasses.replace(policy, description=description)
    save_policy(tmp_path / "any.npz", dataclasses.replace(policy, view=view))
    fitted = resolve_policy(str(tmp_path / "any.npz"), scenario)
    assert isinstance(fitted, LearnedPolicy)
    assert fitted.view.base == make_policy("admittance", scenario)
    stages = scenario.part.stages
    assert fitted.view.axes == StageAxes(
        "vy",
        (stages[0].end, stages[1].end),
        scenario.task.travel_success / stages[0].radius,
    )
    save_policy(tmp_path / "own.npz", policy)
    with refused("way out", "vy"):
        resolve_policy(str(tmp_path / "own.npz"), scenario)
