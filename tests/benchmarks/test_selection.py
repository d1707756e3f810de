"""The judge of effect selection: its cases, its scores and its programs."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from selection import ablation, judge, scores, sketch
from selection.answer import FAILED, Answer, Case
from selection.cases import case_of, chosen, known_cases
from selection.columns import Columns
from selection.hidden import Truth, hide
from selection.noise import drawn_noise
from selection.readings import Plan, write_sensor_case

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.program import ProgressBar
from drake_disasm.logs import read_log
from sysid.models.from_logs import ModelChoice, model_of

_CASE = Case(
    "joint/one/2x/white/one",
    ("log",),
    "one",
    "white",
    hidden=("JointDelay.joint_1",),
    values={"JointDelay.joint_1.delay": 0.01},
    level=2.0,
)


def _judged(case: Case = _CASE, ending: str = "explained", **said: object):
    return scores.Judged(case, Answer(ending, **said))  # type: ignore[arg-type]


def test_a_name_is_right_if_it_or_its_set_was_put_in() -> None:
    """Wrong is what neither was put in nor has a rival that was."""
    right = _judged(confirmed=("JointDelay.joint_1", "TorqueOffset.joint_2"))
    assert (right.named, right.in_set) == (1, 1)
    assert right.wrong == ("TorqueOffset.joint_2",)
    tied = _judged(
        confirmed=("ArmDelay",), ambiguous={"ArmDelay": ("JointDelay.joint_1",)}
    )
    assert (tied.named, tied.in_set, tied.wrong) == (0, 1, ())


def test_none_is_false_where_something_of_twice_the_noise_is_hidden() -> None:
    """What is as small as the noise may be missed; a real log lacks something."""
    small = dataclasses.replace(_CASE, level=1.0)
    real = Case("real/emps_fit/whole", ("log",), "real whole")
    assert _judged(ending="none").is_false_none
    assert _judged(real, ending="none").is_false_none
    assert not _judged(small, ending="none").is_false_none
    assert not _judged(ending="too short").is_false_none


def test_an_alarm_is_a_confirmed_name_in_a_null_log() -> None:
    """A suggested one is none."""
    null = dataclasses.replace(_CASE, group="null", hidden=(), values={}, level=0.0)
    assert _judged(null, confirmed=("ArmDelay",)).is_alarm
    assert not _judged(null, suggested=("ArmDelay",)).is_alarm


def test_a_table_counts_effects_and_logs_apart() -> None:
    """What is left out of the library is no name that could be given."""
    case = dataclasses.replace(_CASE, least_error=0.05)
    left_out = dataclasses.replace(
        case, name="joint/left out/x", group="left out", left_out=("JointDelay",)
    )
    found = [_judged(case, confirmed=case.hidden, after=0.1), _judged(left_out)]
    rows = {row[1]: row for row in scores.table({"x": found})}
    assert {len(row) for row in rows.values()} == {len(scores.COLUMNS)}
    assert rows["all simulated, none left out"][2:5] == [1, 1, 100.0]
    ratio = scores.COLUMNS.index("after / least")
    assert rows["joint, one, 2x"][ratio] == pytest.approx(2.0)


def test_halves_agree_by_names_and_by_sizes() -> None:
    """The Jaccard index of {A, B} and {B, C} is a third."""
    assert scores.jaccard(("A", "B"), ("B", "C")) == pytest.approx(1.0 / 3.0)
    assert scores.jaccard((), ()) is None
    first = Answer("explained", ("A",), sizes={"A.x": (1.0, 0.9, 1.1)})
    near = Answer("explained", ("A",), sizes={"A.x": (1.3, 1.05, 1.5)})
    far = Answer("explained", ("A",), sizes={"A.x": (2.0, 1.5, 2.5)})
    assert scores.compatible(first, near) == (1, 1)
    assert scores.compatible(first, far) == (0, 1)


@pytest.mark.parametrize(("kind", "rho"), [("white", 0.0), ("ar0.9", 0.9), ("t3", 0.0)])
def test_noise_is_correlated_as_its_name_says(kind: str, rho: float) -> None:
    """And of unit variance."""
    noise = drawn_noise(kind, np.random.default_rng(0), 20_000, 3)
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    assert np.mean(noise[1:] * noise[:-1]) == pytest.approx(rho, abs=0.1)


def _plan(group: str = "one", level: float = 5.0, noise: str = "white") -> Plan:
    kinds = (("SensorWarmUp",),) if level else ()
    return Plan("static100/x", group, noise, kinds, level, 57_001)


def test_a_hidden_effect_is_as_large_as_asked_for(tmp_path: Path) -> None:
    """By least squares on the load's and the bias's columns, written out here."""
    case = write_sensor_case(_plan(level=0.0), tmp_path)
    model = model_of([read_log(Path(case.logs[0]))], ModelChoice())
    noise = np.array([0.05] * 3 + [0.002] * 3)
    theta = np.full(len(model.parameters), 0.1)
    truth = Truth.of(model, theta, noise)
    hidden = hide(truth, ("SensorWarmUp",), 2.0, np.random.default_rng(1))
    change = ((hidden.clean - truth.clean) / noise).ravel()
    steps = np.eye(len(theta))
    columns = [(model.predictions(theta + d) - truth.clean) / noise for d in steps]
    A = np.column_stack([c.ravel() for c in columns])
    left = change - A @ np.linalg.lstsq(A, change, rcond=None)[0]
    rms = np.sqrt(np.mean(left.reshape(-1, 6) ** 2, axis=0)).max()
    assert hidden.hidden == ("SensorWarmUp",)
    assert rms == pytest.approx(2.0, rel=0.06)


def test_a_case_is_written_again_the_same(tmp_path: Path) -> None:
    """Whatever was written before: a case depends on its seed alone."""
    name = chosen(["static100/three/*"])[0]
    first, second = (case_of(name, tmp_path / part) for part in ("one", "two"))
    tables = [read_log(Path(c.logs[0])).episodes[0]["wrench"] for c in (first, second)]
    assert first.values == second.values
    np.testing.assert_array_equal(*tables)


def test_every_case_is_counted_once_and_patterns_choose() -> None:
    """A pattern that stands for none is refused."""
    names = chosen(["all"])
    assert len(set(names)) == len(names) and set(names) <= set(known_cases())
    assert all(name.startswith("joint/null/") for name in chosen(["joint/null/*"]))
    with pytest.raises(DisasmError, match="no case has such a name"):
        chosen(["joints/*"])


def test_columns_recover_what_was_hidden(tmp_path: Path) -> None:
    """Least squares on the columns of a gain that drifts gives its rates back."""
    plan = dataclasses.replace(_plan(level=20.0), kinds=(("SensorGainDrift",),))
    case = write_sensor_case(plan, tmp_path)
    columns = Columns.of(case)
    kind = "SensorGainDrift."
    own = [i for i, f in enumerate(columns.fields) if f.startswith(kind)]
    found = columns.solution(own, columns.weight(own))[len(columns.theta) :]
    true = np.array([case.values[columns.fields[i]] for i in own])
    assert found == pytest.approx(true, abs=0.1 * np.abs(true).max())


def test_the_sketch_names_what_is_large_and_nothing_in_noise(tmp_path: Path) -> None:
    """A gain of ten times the noise, and a null log."""
    plan = dataclasses.replace(_plan(level=10.0), kinds=(("SensorGain",),))
    said = sketch.select(write_sensor_case(plan, tmp_path / "gain"))
    assert "SensorGain" in {*said.confirmed, *sum(said.ambiguous.values(), ())}
    assert said.after is not None and said.before is not None
    assert said.after < said.before
    null = sketch.select(write_sensor_case(_plan("null", 0.0), tmp_path / "null"))
    assert (null.ending, null.confirmed) == ("none", ())


def test_the_judge_keeps_answers_and_asks_failures_again(tmp_path: Path) -> None:
    """A selector that fails has an answer, too."""
    name = chosen(["static100/null/white/*"])[0]
    asked = []

    def select(case: Case) -> Answer:
        asked.append(case.name)
        if len(asked) == 1:
            raise ValueError("no luck")
        return Answer("none")

    for _ in range(3):
        kept = FinishedWork(tmp_path / "answers")
        with ProgressBar() as progress:
            [found] = judge.judged(select, [name], tmp_path, kept, progress, "x")
        if len(asked) == 1:
            assert found.answer.text == f"{FAILED}ValueError: no luck"
    assert found.answer.ending == "none" and len(asked) == 2


def test_an_ablation_counts_what_changes() -> None:
    """One name lost, and one wrong name more."""
    found = ablation.row(
        ("alpha", 0.1),
        0.05,
        [_judged(confirmed=("JointDelay.joint_1",), after=0.1)],
        [_judged(confirmed=("ArmDelay",), after=0.2)],
    )
    assert found[:4] == ["alpha", "0.1", "0.05", 1]
    assert found[4:9] == ["-1", "-1", "+1", "0", "0"] and found[9] == "x 2.000"
