"""How steps begin that follow a jump of the force, against Drake's twin."""

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_disasm.cell.grip import deflection
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.effects import GrooveFriction, GrooveViscousFriction
from drake_disasm.logs import Log, LogWriter, read_log
from drake_disasm.logs.columns import flat_columns
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.systems.observation import Mounting
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import EpisodeRecorder, transitions_header
from drake_disasm.task.simulation import TaskSimulation
from sysid.models.grip_observer import shrunk
from sysid.models.grip_state import GripState
from sysid.models.transitions import Transitions
from sysid.models.twin import TwinModel
from sysid.objective import rms

_SCENARIO = load_scenario("removal", ["contact.model=impact", "task.steps=40"])
_NOTHING = np.zeros(0)


class _Watched(EpisodeRecorder):
    """Records an episode of the twin, and how far the grip gives."""

    def __init__(self, simulation: TaskSimulation) -> None:
        super().__init__(simulation)
        self.give: list[np.ndarray] = []

    def _measured(self):
        station, root = self._simulation.station, self._simulation.context
        bolt = station.plant.GetPositions(station.plant.GetMyContextFromRoot(root))
        node = station.arm_node.system
        arm = node.GetMyContextFromRoot(root).get_discrete_state_vector()
        self.give.append(bolt - arm.CopyToVector()[:6])
        return super()._measured()


@pytest.fixture(scope="module")
def dragged(tmp_path_factory) -> tuple[Log, Scenario, np.ndarray]:
    """An episode under a drag that turns the bolt by millimetres when it turns back."""
    real = dataclasses.replace(_SCENARIO, effects=[GrooveViscousFriction(600.0)])
    policy = Exploring(make_policy("admittance", real), 1.5e-4, 0)
    simulation = TaskSimulation(real, "twin", policy)
    recorder = _Watched(simulation)
    run_episode(simulation, 0, recorder)
    folder = tmp_path_factory.mktemp("dragged") / "log"
    with LogWriter(folder, transitions_header(real, "twin", {})) as writer:
        writer.write_episode(flat_columns("transitions", recorder.columns()))
    return read_log(folder), real, np.array(recorder.give)[:-1]


def _residual(model: TwinModel) -> np.ndarray:
    return model.measurements.weighted(model.predictions(_NOTHING))


def _give(begun: Transitions, grip: GripState) -> np.ndarray:
    wrench = begun.steps.wrench
    return np.asarray(deflection(grip.springs, begun.p_BoTo_B, grip.rest[:3], wrench))


def test_the_springs_wrench_is_that_which_has_them_give():
    grip, random = GripState.of(_SCENARIO), np.random.default_rng(0)
    wrench = random.uniform(-1, 1, (5, 6)) * ([5.0] * 3 + [0.2] * 3)
    grip = dataclasses.replace(grip, rest=np.array([0.1, -0.2, -3.0, 0.0, 0.0, 0.0]))
    p_BoTo_B = twin_of(_SCENARIO).p_BoTo_B
    give = deflection(grip.springs, p_BoTo_B, grip.rest[:3], wrench)
    np.testing.assert_allclose(grip.carried(give), wrench, atol=1e-12)


def test_noise_scatters_the_springs_wrench_as_stated():
    grip, random = GripState.of(_SCENARIO), np.random.default_rng(0)
    noise = np.array([0.1] * 3 + [0.01] * 3)
    read = noise * random.standard_normal((4000, 6))
    found = np.std(grip.elastic(read) @ grip.to_grip.T, axis=0)
    mounting = Mounting(RigidTransform(), np.eye(3), 0.0, np.zeros(3), np.zeros(3))
    stated = grip.scatter(noise, mounting, of_growth=False)
    np.testing.assert_allclose(found, stated, rtol=0.05)


def test_what_is_within_the_noise_is_not_believed_and_the_rest_almost():
    missed = np.array([0.5, -1.0, 2.0, -10.0, 0.0])
    found = shrunk(missed, np.ones(5))
    np.testing.assert_allclose(found, [0.0, 0.0, 1.5, -9.9, 0.0])


def test_steps_begin_where_the_bolt_is(dragged):
    log, scenario, give = dragged
    model = TwinModel([log], scenario, ())
    begun = model.with_begins(_NOTHING)
    grip = model._whole.episodes[0].grip
    errors = [_give(each._whole, grip) - give for each in (model, begun)]
    before, after = (np.sqrt(np.mean(e[:, :3] ** 2, axis=0)) for e in errors)
    assert before[0] > 2e-4 and after[0] < 0.25 * before[0]
    assert np.all(after < 2e-4)  # the noise of the force along y alone gives 0.25 mm


def test_at_the_truth_a_strong_drag_leaves_the_noise(dragged):
    log, scenario, _ = dragged
    model = TwinModel([log], scenario, ())
    before, after = (_residual(m)[:, 6:] for m in (model, model.with_begins(_NOTHING)))
    assert rms(before) > 5.0 and rms(after) < 1.3


def test_a_thinned_log_begins_as_the_whole_does(dragged):
    log, scenario, _ = dragged
    model = TwinModel([log], scenario, ())
    thin, whole = model.thin(2).with_begins(_NOTHING), model.with_begins(_NOTHING)
    rows = thin._transitions.rows
    parts = thin._transitions.steps.wrench, whole._transitions.steps.wrench[rows]
    assert np.abs(np.subtract(*parts))[:, :3].max() < 0.3
    np.testing.assert_array_equal(
        whole.thin(2)._transitions.steps.wrench, whole._transitions.steps.wrench[rows]
    )
    assert whole.with_begins(_NOTHING) is whole


def test_where_a_model_leads_nowhere_steps_begin_as_the_wrench_says(dragged):
    """At a parameter set that the scenario refuses, say."""
    log, scenario, _ = dragged
    model = TwinModel([log], scenario, ())
    broken = dataclasses.replace(scenario.part, neck_diameter=0.011)
    refused = model.replace(scenario=dataclasses.replace(scenario, part=broken))
    assert refused.with_begins(_NOTHING) is refused


def test_what_a_grip_that_gives_leaves_unknown_is_little_and_less_of_a_stiff_one(
    dragged,
):
    log, scenario, _ = dragged
    model = TwinModel([log], scenario, ())
    error = model.begin_error(_NOTHING)
    assert error is not None and error.shape == model.measurements.values.shape
    assert 0.03 < np.median(error[:, 6:]) < 0.5
    stiff = dataclasses.replace(scenario.gripper, compliance="rigid")
    rigid = TwinModel([log], dataclasses.replace(scenario, gripper=stiff), ())
    held = rigid.begin_error(_NOTHING)
    assert held is not None and np.median(held[:, 6:]) < 0.1 * np.median(error[:, 6:])
    assert model.replace(rollout=True).begin_error(_NOTHING) is None


def test_a_log_that_the_grip_decides_is_out_of_the_models_range(dragged):
    """Of steps as they are; and of ones that no force balances."""
    log, scenario, _ = dragged
    model = TwinModel([log], scenario, ())
    quiet = model.with_begins(_NOTHING).validity(_NOTHING)
    assert quiet is not None and quiet.holds and 1e-3 < quiet.give < 0.02
    rough = dataclasses.replace(scenario, effects=[GrooveFriction(1.5)])
    found = model.replace(scenario=rough).validity(_NOTHING)
    assert found is not None and not found.holds
    assert model.replace(rollout=True).validity(_NOTHING) is None
