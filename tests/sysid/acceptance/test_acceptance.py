"""The rule by which the corrected twin accepts a policy."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.progress import ProgressUpdate
from drake_disasm.mdp import Outcome
from drake_disasm.policies import load_policy, save_policy
from sysid.acceptance import DRAWS, Acceptance, CorrectedTwin, accept
from sysid.acceptance.trials import Trial
from tests.refusals import refused
from tests.tools.inputs import write_closed, write_policy

_PASSES = Trial(0, Outcome.SUCCESS, {}, 1.0, 2.0, 3.0, 0.1, 0.2)
_PUSHES = dataclasses.replace(_PASSES, outcome=Outcome.FORCE_LIMIT, peak_force=31.0)


def judged(failing: int, values: Trial = _PASSES, draws: int = DRAWS) -> Acceptance:
    trials = (_PUSHES,) * failing + (_PASSES,) * (draws - failing)
    return Acceptance("mine", values, trials, _PASSES)


def test_it_takes_the_values_and_every_draw() -> None:
    assert judged(0).is_accepted
    assert not judged(1).is_accepted
    assert judged(1).failures == {"force limit": 1}
    assert not judged(0, values=_PUSHES).is_accepted


def test_the_draws_are_the_fewest_that_show_ninety_percent() -> None:
    assert judged(0).success_low == pytest.approx(0.05 ** (1.0 / DRAWS))
    assert judged(0).success_low > 0.9
    assert judged(0, draws=DRAWS - 1).success_low < 0.9


def with_drawn(fails: np.ndarray, **drawn: np.ndarray) -> Acceptance:
    trials = tuple(
        dataclasses.replace(
            _PUSHES if failed else _PASSES,
            drawn={name: float(values[i]) for name, values in drawn.items()},
        )
        for i, failed in enumerate(fails)
    )
    return Acceptance("mine", _PASSES, trials, _PASSES)


def test_the_parameter_that_separates_failures_is_named() -> None:
    random = np.random.default_rng(0)
    a, b = random.uniform(size=(2, DRAWS))
    found = with_drawn(a < 0.25, a=a, b=b).separation
    assert found is not None
    assert found.parameter == "a" and found.auc == 0.0 and "low" in found.text
    chance = with_drawn(random.permutation(a < 0.25), a=a, b=b)
    assert chance.separation is None
    assert with_drawn(np.ones(DRAWS, bool), a=a).separation is None  # nothing differs
    assert with_drawn(a == a.min(), a=a).separation is None  # one failure is chance


def test_many_parameters_are_no_more_often_named_by_chance() -> None:
    """5 % of verdicts on failures at random, however many parameters there are."""
    random, named = np.random.default_rng(1), 0
    for _ in range(200):
        drawn = {str(i): random.uniform(size=DRAWS) for i in range(8)}
        named += (
            with_drawn(random.uniform(size=DRAWS) < 0.4, **drawn).separation is not None
        )
    assert named <= 18  # binomial, 95 %: 10 expected


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> CorrectedTwin:
    return CorrectedTwin.read(write_closed(tmp_path_factory.mktemp("closed")))


def test_an_arm_that_falls_short_is_too_slow_in_some_draws(
    twin: CorrectedTwin,
) -> None:
    """`straight` does 3 mm in 4 steps of 1 mm if the gain is above -0.25."""
    [found] = accept(["straight"], twin, draws=12)
    assert found.values.succeeded and found.nominal.succeeded
    assert not found.is_accepted and set(found.failures) == {"step limit"}
    for trial in found.draws:
        gain = trial.drawn["CommandGain.x"]
        if abs(gain + 0.25) > 0.02:  # the arm lags a little, too
            assert trial.succeeded == (gain > -0.25)
    separation = found.separation
    assert separation is not None and separation.auc == 0.0
    [again] = accept(["straight"], twin, draws=2)
    assert again.draws == found.draws[:2] and again.values == found.values
    [other] = accept(["straight"], twin, draws=2, seed=100)
    assert other.draws != again.draws


def test_the_nominal_twin_does_not_have_the_effect(tmp_path: Path) -> None:
    twin = CorrectedTwin.read(write_closed(tmp_path, gain=-0.4))
    [found] = accept(["straight"], twin, draws=1)
    assert not found.values.succeeded and found.nominal.succeeded


def test_accepted_ones_come_first_whatever_their_order(twin: CorrectedTwin) -> None:
    narrow = dict(twin.verdict)
    value = dict(narrow["parameters"]["CommandGain.x"]) | {"interval_95": [-0.2, -0.1]}
    narrow["parameters"] = {"CommandGain.x": value}
    other = CorrectedTwin(twin.scenario, narrow)
    found = accept(["admittance", "straight", "admittance"], other, draws=2)
    assert len(found) == 2 and found[0].is_accepted
    assert [f.is_accepted for f in found] == sorted(
        (f.is_accepted for f in found), reverse=True
    )


def test_a_run_that_was_stopped_goes_on(twin: CorrectedTwin, tmp_path: Path) -> None:
    whole, done = accept(["straight"], twin, draws=4), []

    def stop(update: ProgressUpdate) -> None:
        done.append(update.done)
        if max(done) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        accept(["straight"], twin, draws=4, folder=tmp_path, progress=stop)
    kept = [json.loads(x) for x in (tmp_path / "results.jsonl").open()]
    assert len(kept) == 2
    again = list[int]()
    found = accept(
        ["straight"], twin, draws=4, folder=tmp_path,
        progress=lambda update: again.append(update.total),
    )  # fmt: skip
    assert found == whole and max(again) == 6 - len(kept)


def test_another_policy_in_the_same_file_is_tried_anew(
    twin: CorrectedTwin, tmp_path: Path
) -> None:
    file, kept = tmp_path / "policy.npz", tmp_path / "kept"
    write_policy(file)
    accept([str(file)], twin, draws=1, folder=kept)
    before = (kept / "results.jsonl").read_text()
    accept([str(file)], twin, draws=1, folder=kept)
    assert (kept / "results.jsonl").read_text() == before
    policy = load_policy(file)
    view = dataclasses.replace(policy.view, observation_scale=np.full(12, 2.0))
    save_policy(file, dataclasses.replace(policy, view=view))
    accept([str(file)], twin, draws=1, folder=kept)
    assert len((kept / "results.jsonl").read_text()) > len(before)


def test_a_policy_that_does_not_fit_is_refused_before_any_episode(
    twin: CorrectedTwin, tmp_path: Path
) -> None:
    write_policy(tmp_path / "slow.npz", period=0.2)

    def never(_: ProgressUpdate) -> None:
        raise AssertionError("policies are checked first")

    with refused("task.period", "0.2"):
        accept(["straight", str(tmp_path / "slow.npz")], twin, progress=never)
    with refused("does not exist"):
        accept(["strait"], twin, progress=never)
