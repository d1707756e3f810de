"""A sensor in a task with contact is judged by what it reads in free space."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import BaseTilt, SensorCrossTalk, SensorDrift
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from sysid.data_checks import check_data, without_flagged_rows
from sysid.effect_selection.close_loop import close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.parameters import nominal_values
from tests.refusals import refused
from tests.sysid.models.contact_task import CENTRE, MASS, task, write_task
from tests.sysid.real_data import real_folder

ten = task()
clock = (ten.time / ten.time[-1])[:, None]
_LIBRARY = (SensorDrift, SensorCrossTalk, BaseTilt)
TRUTH = np.array([MASS, *(MASS * CENTRE), 1.0, -2.0, 3.0, 0.1, -0.2, 0.05])


def model(log):
    return model_of([log], ModelChoice(fixed=True))


def test_stated_rows_are_read_with_their_times_in_the_log(tmp_path):
    later = dataclasses.replace(ten, free=~ten.free, time=ten.time + 100.0)
    made = model(write_task(tmp_path / "log", later, states_free=True))
    np.testing.assert_array_equal(made.measurements.values, later.wrench[later.free])
    np.testing.assert_allclose(made.poses.clock, ten.time[later.free])
    [rows] = made.rows_in_use.values()
    np.testing.assert_array_equal(rows, np.flatnonzero(later.free))


def test_the_wrench_of_the_contact_is_what_the_load_leaves(tmp_path):
    made = model(write_task(tmp_path / "log", ten, states_free=True))
    described = made.describe(TRUTH)
    touching = (ten.contact + ten.noise)[~ten.free]
    size = np.sqrt(np.mean(np.sum(touching[:, :3] ** 2, axis=1)))
    assert described["contact force (rms)"][0] == pytest.approx(size, rel=2e-3)
    assert described["weight"][0] == pytest.approx(9.81 * MASS, rel=1e-3)
    of_rows, *others = made.assumptions
    assert f"{ten.free.sum()} of {len(ten.time)} rows" in of_rows.what and not others


def test_a_log_without_contact_says_nothing_of_one(tmp_path):
    free = dataclasses.replace(ten, contact=0.0 * ten.contact, free=ten.free | True)
    made = model(write_task(tmp_path / "log", free, states_free=True))
    assert "contact force (rms)" not in made.describe(nominal_values(made.parameters))


def test_rows_that_do_not_vary_in_orientation_are_said_to(tmp_path):
    still = ten.plus(-ten.load)
    held = dataclasses.replace(still, R_WS=still.R_WS[np.zeros(len(ten.time), int)])
    made = model(write_task(tmp_path / "log", held, states_free=True))
    assert "orientation" in made.assumptions[-1].what
    assert "three" in made.assumptions[-1].remedy


def test_what_is_not_told_is_refused_with_the_remedy(tmp_path):
    held = task(0, share=0.15)
    with refused("log: it is not told which rows are in free space", "`free`"):
        model(write_task(tmp_path / "log", held))
    none = dataclasses.replace(held, free=held.free & False)
    with refused("none: no row is in free space", "`free`"):
        model(write_task(tmp_path / "none", none, states_free=True))
    half = dataclasses.replace(held, free=0.5 * held.free)
    with refused("half: column 'free' is neither 0 nor 1"):
        model(write_task(tmp_path / "half", half, states_free=True))


def test_a_real_arm_whose_estimate_changes_with_its_friction_is_not_told(tmp_path):
    path = real_folder("cases") / "contact_as_static" / "run.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    columns = {"time": table[:, 0], "R_WS": table[:, 1:5], "wrench": table[:, 5:]}
    header = LogHeader("contact", "press", {}, frames={"wrench": "S"})
    with LogWriter(tmp_path / "log", header) as writer:
        writer.write_episode(flat_columns("contact", columns))
    with refused("it is not told which rows are in free space"):
        model(read_log(tmp_path / "log"))


def test_findings_number_the_rows_of_the_table(tmp_path):
    row = int(np.flatnonzero(ten.free)[300])
    spike = np.zeros_like(ten.load)
    spike[row, 0] = 50.0
    log = write_task(tmp_path / "log", ten.plus(spike), states_free=True)
    made = model(log)
    [found] = [f for f in check_data([log], made) if f.kind == "spikes"]
    assert found.rows == {"log/episode_0000": (row,)}
    rest = without_flagged_rows([log], made, [found])
    assert rest.measurements.rows == made.measurements.rows - 1
    assert rest.measurements.values[:, 0].max() < 30.0


def test_contact_in_rows_that_are_said_to_be_free_is_found(tmp_path):
    half = task(share=0.5)
    wrong = dataclasses.replace(half, contact=3.0 * half.contact, free=half.free | True)
    log = write_task(tmp_path / "log", wrong, states_free=True)
    assert "contact" in {f.kind for f in check_data([log], model(log))}


def test_inertia_of_a_load_that_turns_is_found(tmp_path):
    """Forces that come and go while the sensor turns, and not while it rests."""
    turning = ten.free & (np.abs(ten.time % 12.0 / 12.0 - 0.15) < 0.075)
    force = turning * np.where(np.arange(len(ten.time)) % 4 < 2, 2.0, -2.0)
    inertia = force[:, None] * [1.0, 0.5, 0.0, 0.0, 0.0, 0.0]
    logs = [
        write_task(tmp_path / name, of, states_free=True)
        for name, of in (("log", ten.plus(inertia)), ("without", ten))
    ]
    found, without = (
        {f.kind: f for f in check_data([log], model(log))} for log in logs
    )
    assert "moving" in found and "moving" not in without
    [rows] = found["moving"].rows.values()
    assert np.mean(turning[list(rows)]) > 0.8


@pytest.mark.parametrize(
    ("more", "named"),
    [
        pytest.param(0.0 * ten.load, set(), marks=pytest.mark.slow),
        (clock * [3.0, 0.0, -2.0, 0.1, 0.0, 0.0], {"SensorDrift"}),
        (0.1 * ten.load[:, [2]] * [0, 1.0, 0, 0, 0, 0], {"SensorCrossTalk"}),
    ],
    ids=["nothing", "drift", "cross-talk"],
)
def test_the_sensor_is_judged_and_the_contact_raises_no_alarm(more, named, tmp_path):
    made = model(write_task(tmp_path / "log", ten.plus(more)))
    closed = close_loop(made, library=_LIBRARY)
    assert set(closed.verdict.names) == named and not closed.verdict.misfits
    weight, _ = closed.derived["weight"]
    assert weight == pytest.approx(9.81 * MASS, rel=5e-3)
