"""The batched twin against the diagram, which is right where they differ."""

import dataclasses

import numpy as np
import pytest
import torch

from drake_disasm import effects as ef
from drake_disasm.common.arrays import to_numpy
from drake_disasm.effects.base import ArmEffect, PoseEffect
from drake_disasm.scenario import Scenario, load_scenario, with_values
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.twin.batch import BatchedTwin
from tests.drake_disasm.effects.learned_files import step_in_fy
from tests.drake_disasm.twin.sizes import EFFECTS, actions

SETTINGS = [
    "contact.model=impact",
    "ft_sensor.noise=[0, 0, 0, 0, 0, 0]",
    "ft_sensor.quantum=[0, 0, 0, 0, 0, 0]",
    "task.max_translation=0.003",
    "task.max_rotation=0.01",
]
TURNED = load_scenario("removal_turned", SETTINGS)
CASES: list[list[ef.Effect]] = [[], *([effect] for effect in EFFECTS)]
CASES.append([EFFECTS[0], EFFECTS[3], EFFECTS[10], EFFECTS[15], EFFECTS[19]])
NAMES = ["+".join(type(e).__name__ for e in case) or "none" for case in CASES]
WHOLE = 27  # steps: to the end of the groove
BEGIN = 5  # of them in contact: from the third


def _scenario(effects: list[ef.Effect]) -> Scenario:
    return dataclasses.replace(TURNED, effects=[*TURNED.effects, *effects])


def _actions(effects: list[ef.Effect]) -> np.ndarray:
    """Returns an episode's actions; what scatters by bits gets no rotation."""
    return actions(WHOLE, turn=0.0 if ef.Imprecision in map(type, effects) else 4e-3)


@pytest.fixture(scope="module")
def batch() -> np.ndarray:
    """States (WHOLE + 1, cases, 12) of one batch, an environment for each case."""
    twin = BatchedTwin([_scenario(effects) for effects in CASES], device="numpy")
    moves = np.stack([_actions(effects) for effects in CASES], axis=1)
    states = [twin.reset([0] * len(CASES)).copy()]
    for action in moves:
        result = twin.step(action)
        assert not any(result.failure)
        states.append(result.observation.copy())
    return np.array(states)


def _batch(
    scenarios: list[Scenario], moves: np.ndarray, device: str = "numpy"
) -> np.ndarray:
    """Returns states (steps + 1, environments, 12) under the same actions."""
    twin = BatchedTwin(scenarios, device=device)
    states = [to_numpy(twin.reset([0] * len(scenarios))).copy()]
    for action in moves:
        repeated = np.repeat(action[None], len(scenarios), axis=0)
        states.append(to_numpy(twin.step(repeated).observation).copy())
    return np.array(states)


def _diagram(scenario: Scenario, moves: np.ndarray) -> np.ndarray:
    simulation = TaskSimulation(scenario, "twin")
    first = simulation.reset(0)
    return np.array([first, *(simulation.step(a).observation for a in moves)])


def _assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    """To 10 nm and thousandths of a newton; asked for were 1 um and 0.02 N."""
    np.testing.assert_allclose(found[:, :3], expected[:, :3], atol=1e-8)
    np.testing.assert_allclose(found[:, 3:6], expected[:, 3:6], atol=1e-7)
    np.testing.assert_allclose(found[:, 6:9], expected[:, 6:9], atol=2e-3)
    np.testing.assert_allclose(found[:, 9:], expected[:, 9:], atol=1e-4)


@pytest.mark.parametrize("case", range(len(CASES)), ids=NAMES)
def test_an_episode_begins_as_the_diagrams(batch, case):
    moves = _actions(CASES[case])[:BEGIN]
    expected = _diagram(_scenario(CASES[case]), moves)
    assert np.abs(expected[:, 8]).max() > 0.5 or "DeadBand" in NAMES[case]
    _assert_same(batch[: BEGIN + 1, case], expected)


@pytest.mark.slow
@pytest.mark.parametrize("case", range(len(CASES)), ids=NAMES)
def test_a_whole_episode_is_the_diagrams(batch, case):
    """And the effect shows in it, five times what the two may differ by."""
    moves = _actions(CASES[case])
    expected = _diagram(_scenario(CASES[case]), moves)
    assert np.abs(expected[:, 6:9]).max() > 1.0
    _assert_same(batch[:, case], expected)
    if CASES[case] and not isinstance(CASES[case][0], ef.Imprecision):
        away = np.abs(batch[:, case] - batch[:, 0])
        assert max(away[:, :3].max() / 1e-5, away[:, 6:9].max() / 0.01) > 1.0


def test_all_effects_on_the_twin_are_here():
    known = {type(effect) for effect in EFFECTS} | {ef.SensorResidualModel}
    shipped = {e for e in ef.registered_effects() if e.__module__.startswith("drake_")}
    on_twin = {e for e in shipped if not issubclass(e, ArmEffect | PoseEffect)}
    on_twin -= {ef.DetentTorque}  # of a part below
    assert known == on_twin, "give the new effect a size in sizes.py"


def test_a_learned_effect_is_the_diagrams(tmp_path):
    learned = ef.SensorResidualModel(file=str(step_in_fy(tmp_path)), share=0.3)
    scenario, moves = _scenario([learned]), actions(3)
    found = _batch([scenario, TURNED], moves)
    _assert_same(found[:, 0], _diagram(scenario, moves))
    assert np.abs(found[:, 0] - found[:, 1]).max() > 0.1


PEG = [[0.0, 1e-3, 0.0, 0.0, 0.0, 0.0]] * 24
TURN = [[0.0, 0.0, 0.0, 0.0, 0.016, 0.0]] * 64
LIFT = [[0.0, 4e-4, 0.0, 0.0, 0.0, 0.0]] * 18


@pytest.mark.parametrize(
    ("name", "settings", "effects", "way"),
    [
        ("iiwa_peg", [], [ef.GroovePose(z=2e-4, rx=0.01)], PEG),
        ("iiwa_peg", ["part.cross_section=square"], [ef.GroovePose(ry=0.01)], PEG),
        (
            "iiwa_bayonet",
            [],
            [ef.DetentTorque(0.3), ef.GroovePose(x=2e-4)],
            TURN + LIFT,
        ),
    ],
    ids=["round", "square", "bayonet"],
)
def test_other_parts_are_the_diagrams(name, settings, effects, way):
    """On the way out, swayed from wall to wall."""
    scenario = load_scenario(name, [*SETTINGS[:4], *settings])
    scenario = dataclasses.replace(scenario, effects=effects)
    moves, turn = np.array(way), 0.8 * np.arange(len(way))
    moves[:, 0] += 2e-3 * np.sin(turn)
    moves[:, 2] += 2e-3 * np.cos(turn)
    expected, found = _diagram(scenario, moves), _batch([scenario], moves)[:, 0]
    assert np.linalg.norm(expected[:, 6:9], axis=1).max() > 1.0
    _assert_same(found, expected)


@pytest.mark.parametrize(
    "values",
    [
        {"gripper.stiffness.2": 1200.0, "arm.stiffness.1": 5e3},
        {"part.mass": 0.4, "part.neck_diameter": 0.0051},
        {"contact.impact.stiffness": 200.0, "contact.impact.depth": 0.3},
        {"contact.friction": 0.4, "part.clearance": 6e-4},
    ],
    ids=lambda values: "+".join(values),
)
def test_each_environment_has_parameters_of_its_own(values):
    own, moves = with_values(TURNED, values), actions(BEGIN)
    found = _batch([TURNED, own], moves)
    _assert_same(found[:, 1], _diagram(own, moves))
    _assert_same(found[:, 0], _diagram(TURNED, moves))


def test_small_angle_observation_is_the_diagrams():
    settings = [*SETTINGS, "observation.variant=small_angle"]
    scenario, moves = load_scenario("removal_turned", settings), actions(BEGIN)
    _assert_same(_batch([scenario], moves)[:, 0], _diagram(scenario, moves))


def test_reward_place_and_end_are_the_diagrams():
    """Up to the end of the episode: pressed too hard against a wall."""
    gentle = with_values(TURNED, {"task.reward.f_max": 3.0})
    simulation, twin = TaskSimulation(gentle, "twin"), BatchedTwin(gentle)
    simulation.reset(0)
    twin.reset([0])
    for action in actions(WHOLE):
        expected, found = simulation.step(action), twin.step(action[None])
        assert int(found.outcome[0]) == int(expected.outcome)
        for name, term in expected.reward_terms.items():
            assert float(found.reward_terms[name][0]) == pytest.approx(term, abs=5e-3)
        np.testing.assert_allclose(to_numpy(found.place)[0], expected.place, atol=1e-6)
        if expected.outcome:
            break
    # The hand has gone on, the bolt has yielded.
    assert expected.observation[0] - expected.place[0] > 1e-4
    assert expected.outcome.label == "force limit"


def test_torch_computes_what_numpy_does():
    moves, scenarios = actions(5), [_scenario(e) for e in CASES]
    expected, found = (_batch(scenarios, moves, on) for on in ("numpy", "cpu"))
    which = [i for i, case in enumerate(CASES) if ef.Imprecision not in map(type, case)]
    np.testing.assert_allclose(found[:, which], expected[:, which], atol=1e-8)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")
def test_a_gpu_simulates_the_same_episodes(batch):
    moves = np.stack([_actions(effects) for effects in CASES], axis=1)
    twin = BatchedTwin([_scenario(effects) for effects in CASES], device="cuda")
    found = [to_numpy(twin.reset([0] * len(CASES))).copy()]
    found += [to_numpy(twin.step(action).observation).copy() for action in moves]
    _assert_same(np.array(found).reshape(-1, 12), batch.reshape(-1, 12))


@pytest.mark.parametrize(
    ("name", "settings"),
    [("removal_turned", []), ("iiwa_peg", ["part.cross_section=square"])],
)
def test_a_sensor_under_the_part_reads_what_the_diagrams_does(name, settings):
    """What pulls on the bolt besides the part does not reach it."""
    scenario = load_scenario(name, [*SETTINGS, "ft_sensor.place=part", *settings])
    effects, moves = [ef.ChainPull(fx=2.0), ef.SensorLag(0.05)], actions(BEGIN)
    scenario = dataclasses.replace(scenario, effects=effects)
    expected, found = _diagram(scenario, moves), _batch([scenario], moves)[:, 0]
    assert np.linalg.norm(expected[:, 6:9], axis=1).max() > 0.5
    _assert_same(found, expected)


def test_springs_tell_the_wrench_as_the_diagrams_where_there_is_no_sensor():
    settings = [*SETTINGS, "ft_sensor.place=none"]
    scenario, moves = load_scenario("removal_turned", settings), actions(BEGIN)
    _assert_same(_batch([scenario], moves)[:, 0], _diagram(scenario, moves))
