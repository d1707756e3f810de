"""Each kind of finding: a damage that it names, of logs that have no finding."""

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from damaged_logs import (
    both,
    changed,
    damaged,
    late,
    rounded,
    scaled,
    swapped,
)

from drake_disasm.effects import GroovePose
from drake_disasm.logs import Log, read_log
from sysid.data_checks import (
    DEFAULT_DATA_SETTINGS,
    KINDS,
    Severity,
    check_data,
    refuse,
    without_flagged_rows,
)
from sysid.data_checks.constancy import dead_channels
from sysid.data_checks.finding import DataFinding
from sysid.data_checks.units import sign_findings
from sysid.models.base import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from tests.refusals import refused
from tests.sysid.real_data import write_arm, write_motion, write_static

SENSOR = ("wrench", "ft_sensor")


def model(log: Log) -> LogModel:
    return model_of([log], ModelChoice(fixed=True))


def findings(log: Log) -> dict[str, DataFinding]:
    """Returns the findings of a log by their kinds."""
    found = check_data([log], model(log))
    assert {finding.kind for finding in found} <= KINDS.keys()
    return {finding.kind: finding for finding in reversed(found)}


def only(log: Log, kind: str) -> DataFinding:
    """Returns the finding of a log, which has that one alone."""
    found = findings(log)
    assert set(found) == {kind}, [finding.text for finding in found.values()]
    return found[kind]


@pytest.mark.parametrize("name", ["twin_log", "static_log", "world_log", "arm_log"])
def test_a_good_log_has_no_finding(name, request):
    assert findings(request.getfixturevalue(name)) == {}


def test_a_real_sensor_has_no_finding(tmp_path):
    assert findings(read_log(write_static(7, tmp_path / "log"))) == {}


@pytest.mark.slow
def test_of_a_real_arm_only_the_ends_of_its_filter_are_named(tmp_path):
    urdf = write_arm(tmp_path / "arm.urdf")
    found = only(read_log(write_motion(1, tmp_path / "log", urdf)), "derivatives")
    [rows] = found.rows.values()
    assert set(range(5010, 5027)) <= set(rows) <= set(range(5000, 5027))


TWIN, STATIC, ARM = "twin_log", "static_log", "arm_log"
PLACE = [f"X_GB_measured.{axis}" for axis in "xyz"]


@pytest.mark.parametrize(
    ("name", "damage", "kind", "words"),
    [
        (TWIN, scaled(0.0, *SENSOR), "constant", ["fx (the model", "sensor alive"]),
        (STATIC, scaled(0.0, "wrench.fz"), "constant", ["fz (the model"]),
        (STATIC, scaled(0.0, "wrench.f"), "constant", ["fx, fy, fz", "all 100"]),
        (TWIN, rounded(0.5, "wrench.f"), "quantum", ["wrench.fx", "0.5"]),
        (TWIN, scaled(1.3, "time"), "time", ["0.13 s"]),
        (TWIN, scaled(1e3, *PLACE), "units", ["X_GB_measured", "1e+03"]),
        (TWIN, scaled(1e-3, "wrench.f", "ft_sensor.f"), "units", ["forces", "0.001"]),
        (TWIN, scaled(1e3, "wrench.t", "ft_sensor.t"), "units", ["torques"]),
        (TWIN, scaled(57.3, "action.du", "action.dv", "action.dw"), "units", ["57.3"]),
        (ARM, scaled(57.3, "q", "v"), "units", ["half of the joints are beyond q"]),
        (ARM, scaled(57.3, "v."), "units", ["v", "57.3 times"]),
        (ARM, scaled(1e3, "tau"), "units", ["scale of the torques"]),
        (STATIC, scaled(1e-3, "wrench.f"), "units", ["m times the forces"]),
        (TWIN, swapped("wrench.fy", "wrench.fz"), "axes", ["fy = fz, fz = fy"]),
        (TWIN, scaled(-1.0, *SENSOR), "axes", ["fx = -fx", "fz = -fz", "tx = -tx"]),
        (STATIC, swapped("wrench.fx", "wrench.fz"), "axes", ["fx = fz, fz = fx"]),
        ("world_log", scaled(-1.0, "wrench.fx"), "axes", ["fx = -fx"]),
        (STATIC, scaled(-1.0, "wrench"), "axes", ["it pulls up"]),
        (ARM, scaled(-1.0, "tau.0"), "axes", ["tau.0 (shoulder) has the other sign"]),
        (ARM, swapped("tau.0", "tau.1"), "axes", ["tau.1 is that of shoulder"]),
        (ARM, scaled(-1.0, "tau"), "axes", ["tau", "all joints", "wrong sign"]),
        (ARM, scaled(-1.0, "v."), "axes", ["v", "wrong sign"]),
        (TWIN, late(2, *SENSOR), "late", ["wrench is late by 2 rows"]),
        (TWIN, late(1, "X_GB_measured"), "late", ["X_GB_measured is late by 1 row"]),
        (ARM, late(3, "tau.1"), "late", ["tau.1 (elbow) is late by 3 rows"]),
        (ARM, late(2, "v."), "late", ["v is late by 2 rows"]),
    ],
)
def test_a_damage_is_named(name, damage, kind, words, request):
    every = findings(damaged(request.getfixturevalue(name), damage))
    assert set(every) - {"processing"} == {kind}  # where only one copy is damaged
    found = every[kind]
    assert all(word in found.what for word in words), found.what
    if kind in ("constant", "axes", "late"):
        assert (found.severity is Severity.WARN) == (kind == "late")


# Channels that don't change.


def test_one_dead_column_of_the_wrench_is_named(twin_log):
    found = findings(damaged(twin_log, scaled(0.0, "wrench.fy")))["constant"]
    assert "wrench.fy (the model" in found.what and "wrench.fx" not in found.what


def test_a_dead_torque_is_refused_in_the_library_call_too(arm_log):
    log = damaged(arm_log, scaled(0.0, "tau.1"))
    [found] = dead_channels(model(log))
    assert "elbow" in found.what and "shoulder" not in found.what
    with refused("constant in elbow", "is the sensor alive?"):
        refuse([found])
    assert not dead_channels(model(arm_log))


def test_a_sensor_that_stops_is_placed(arm_log):
    held = changed("tau.0", slice(500, 540), lambda values: values[0])
    found = only(damaged(arm_log, held), "stuck")
    assert found.rows == {"log/episode_0000": tuple(range(500, 540))}
    assert "did the sensor stop?" in found.what


def test_saturation_is_a_repeated_end_value(arm_log):
    most = np.quantile(arm_log.episodes[0]["tau"][:, 0], 0.9)
    clipped = changed("tau.0", slice(None), lambda values: np.minimum(values, most))
    assert (
        "tau.0 repeats its end value" in only(damaged(arm_log, clipped), "stuck").what
    )


def test_a_quantum_that_is_fine_or_declared_is_none(twin_log):
    assert "quantum" not in findings(damaged(twin_log, rounded(0.01, "wrench.f")))
    log = damaged(twin_log, rounded(0.5, "wrench.f"))
    chosen = model(log)
    chosen.scenario.ft_sensor.quantum[:3] = [0.5] * 3
    found = check_data([log], chosen)
    assert not [finding for finding in found if finding.kind == "quantum"]


def imported(log: Log, **said: Any) -> Log:
    """Returns a log with what an import says of it."""
    header = dataclasses.replace(log.header, provenance={"import": said})
    return dataclasses.replace(log, header=header)


def test_what_an_import_saw_repeated_is_placed(arm_log):
    """A filter ripples where a sensor stops, so the log repeats nothing."""
    held = {"episode_0000": {"tau.1": [[2.0, 2.5, False], [4.0, 4.1, False]]}}
    found = only(imported(arm_log, held=held), "stuck")
    assert found.rows == {"log/episode_0000": (*range(200, 251), *range(400, 411))}
    assert "tau.1 repeats a value" in found.what


@pytest.mark.parametrize("held", [3, {"episode_0000": {"tau.1": [["x", {}, 1], 2]}}])
def test_a_provenance_that_says_something_else_says_nothing(arm_log, held):
    assert findings(imported(arm_log, held=held)) == {}


# Motions that are none, and encoders that wrap.


def test_an_arm_that_stands_is_refused(arm_log):
    def stand(columns):
        for name in ("q.0", "q.1", "v.0", "v.1", "vd.0", "vd.1"):
            columns[name][:] = 0.5 if name[0] == "q" else 0.0

    found = findings(damaged(arm_log, stand))["still"]
    with refused("no joint moves", "record a motion"):
        refuse([found])


def test_a_motion_that_is_noise_is_named(arm_log):
    done = {"noise_in_accelerations": {}}
    found = only(imported(arm_log, processing=done), "still")
    assert found.severity is Severity.WARN
    done = {"noise_in_accelerations": {"q.1": 0.01}}
    assert findings(imported(arm_log, processing=done)) == {}


def test_an_encoder_that_wraps_is_placed(arm_log):
    q = arm_log.episodes[0]["q"][:, 0]
    turned = changed("q.0", slice(None), lambda v: (v + np.pi - 0.3) % (2 * np.pi))
    wrapped = changed("q.0", slice(None), lambda v: np.where(v > 0.3, v - 2 * np.pi, v))
    assert "derivatives" not in findings(damaged(arm_log, turned))
    found = findings(damaged(arm_log, wrapped))["derivatives"]
    assert "q.0 jumps by a whole turn" in found.what
    [rows] = found.rows.values()
    jumps = np.flatnonzero(np.diff(q > 0.3)) + 1
    assert set(rows) == set(jumps.tolist())


# Time, and rest.


def test_a_jump_of_time_is_placed(arm_log):
    jump = changed("time", slice(400, None), lambda values: values + 0.3)
    found = findings(damaged(arm_log, jump))["time"]
    assert found.rows == {"log/episode_0000": (400,)}


def test_jitter_is_no_jump(arm_log):
    jitter = np.random.default_rng(0).uniform(-0.2, 0.2, 800) * 0.01
    log = damaged(arm_log, changed("time", slice(None), lambda values: values + jitter))
    assert "time" not in findings(log)


def test_a_clock_that_hiccups_is_placed(arm_log):
    def hiccup(columns):
        time = columns["time"]
        real = time + 0.02 * np.clip(np.arange(len(time)) - 400, 0, 8)
        for name in set(columns) - {"time"}:
            columns[name] = np.interp(real, time, columns[name])

    found = findings(damaged(arm_log, hiccup))["derivatives"]
    [rows] = found.rows.values()
    hiccups = {row for row in rows if row < 700}  # at the end nothing is left to read
    assert set(range(401, 408)) <= hiccups <= set(range(399, 410))
    assert "velocities are not the derivatives of the positions" in found.what


def test_a_noisy_velocity_contradicts_nothing(arm_log):
    noise = np.random.default_rng(0).normal(size=800)
    noisy = changed("v.0", slice(None), lambda values: values + 0.3 * noise)
    assert "derivatives" not in findings(damaged(arm_log, noisy))


def resting(static_log: Log, between: int) -> Log:
    """Returns a recording at 20 Hz: a second of rest at each pose, then some rows on
    the way to the next.
    """
    first = static_log.episodes[0]
    q = first["R_WS"][:8]
    rows = []
    for here, there in itertools.pairwise(q):
        there = there * np.sign(here @ there)
        way = np.linspace(0.0, 1.0, between + 2)[1:-1, None]
        rows += [here] * 20 + list((1.0 - way) * here + way * there)
    q = np.array(rows) / np.linalg.norm(rows, axis=1)[:, None]
    columns = {f"R_WS.q{axis}": q[:, i] for i, axis in enumerate("wxyz")}
    columns["time"] = 0.05 * np.arange(len(q))
    columns |= {
        n: np.resize(first.columns[n], len(q)) for n in first.components("wrench")
    }
    return damaged(static_log, lambda own: (own.clear(), own.update(columns)))


def test_readings_that_move_are_placed(static_log):
    found = findings(resting(static_log, 10))["moving"]
    moving = np.array(found.rows["log/episode_0000"])
    expected = np.flatnonzero(np.arange(7 * 30) % 30 >= 20)
    np.testing.assert_array_equal(moving, expected)
    assert "moving" not in findings(resting(static_log, 0))


# wrench against ft_sensor.


def test_rows_whose_wrench_is_not_the_reading_are_placed(twin_log):
    add = changed("wrench.fy", [4, 9], lambda values: values + 5.0)
    found = findings(damaged(twin_log, add, episode=2))["processing"]
    assert found.rows == {"log/episode_0002": (4, 9)}


def test_a_reading_that_was_copied_is_refused(twin_log):
    def copy(columns):
        for axis in ("fx", "fy", "fz", "tx", "ty", "tz"):
            columns[f"wrench.{axis}"] = columns[f"ft_sensor.{axis}"]

    found = only(damaged(twin_log, copy), "processing")
    assert "it is the raw reading" in found.what
    assert found.severity is Severity.REFUSE


def test_another_zero_of_the_sensor_is_allowed(twin_log):
    log = damaged(twin_log, changed("ft_sensor.fz", slice(None), lambda v: v + 30.0))
    assert findings(log) == {}


def test_a_turned_groove_is_no_exchange_of_axes(tmp_path):
    """Its forces are not expected, and weigh less as those of a noisier channel."""
    transitions_log(tmp_path / "log", nominal(), [GroovePose(ry=0.0349)], seed=1)
    assert "axes" not in findings(read_log(tmp_path / "log"))


# Spikes.


def test_spikes_are_placed(arm_log):
    log = damaged(arm_log, changed("tau.1", [100, 350], lambda v: v + 5.0))
    found = only(log, "spikes")
    assert found.rows == {"log/episode_0000": (100, 350)}
    assert found.what.startswith("tau.1: 2 of 800 rows")


def _slower(log: Log) -> Log:
    """Returns a log whose torques a filter has rounded, over five rows."""
    weights = np.full(5, 0.2)

    def blur(columns):
        for name in ("tau.0", "tau.1"):
            columns[name][2:-2] = np.convolve(columns[name], weights, "valid")

    return damaged(log, blur)


def test_rounded_friction_at_a_reversal_is_no_spike(arm_log):
    strong = changed("tau.1", slice(None), lambda v: v + 2.0 * np.sign(_v(arm_log)))
    log = _slower(damaged(arm_log, strong))
    assert "spikes" not in findings(log)


def test_a_spike_at_a_reversal_is_placed(arm_log):
    reversal = int(np.flatnonzero(np.diff(np.sign(_v(arm_log))))[3])
    log = damaged(arm_log, changed("tau.1", [reversal], lambda v: v + 5.0))
    assert findings(log)["spikes"].rows == {"log/episode_0000": (reversal,)}


def test_a_spike_of_the_acceleration_is_placed(arm_log):
    log = damaged(arm_log, changed("vd.1", [350], lambda v: v + 3000.0))
    assert 350 in findings(log)["spikes"].rows["log/episode_0000"]


def _v(log: Log) -> np.ndarray:
    return log.episodes[0]["v"][:, 1]


def test_spikes_of_a_sensor_are_placed(twin_log):
    add = changed("wrench.fx", [4, 9, 16], lambda v: v + 5.0)
    log = damaged(twin_log, both(add, changed("ft_sensor.fx", [4, 9, 16], _minus)), 2)
    assert findings(log)["spikes"].rows == {"log/episode_0002": (4, 9, 16)}


def _minus(values: np.ndarray) -> np.ndarray:
    return values - 5.0  # x of S is opposite to that of B


# Rows that are left out.


def test_flagged_rows_are_left_out(arm_log):
    log = damaged(arm_log, changed("tau.1", [100, 350], lambda v: v + 5.0))
    whole = model(log)
    assert without_flagged_rows([log], whole, ()) is whole
    kept = without_flagged_rows([log], whole, check_data([log], whole))
    assert kept.measurements.rows == 798
    left_out = np.delete(whole.measurements.values, [100, 350], axis=0)
    np.testing.assert_array_equal(kept.measurements.values, left_out)


def test_a_step_that_begins_or_ends_at_a_flagged_row_is_left_out(twin_log):
    add = changed("wrench.fy", [4], lambda values: values + 5.0)
    log = damaged(twin_log, add, episode=2)
    whole = model(log)
    found = check_data([log], whole)
    kept = without_flagged_rows([log], whole, found)
    rows = whole.measurements.rows
    expected = np.delete(whole.measurements.values, [53, 54], axis=0)
    np.testing.assert_array_equal(kept.measurements.values, expected)
    of_rollout = without_flagged_rows([log], whole, found, whole_episodes=True)
    assert of_rollout.measurements.rows == rows - 25
    assert "log/episode_0002" not in of_rollout.measurements.names


def test_nothing_left_is_refused(arm_log):
    rows = {"log/episode_0000": range(800)}
    everything = DataFinding("spikes", "all", "none", rows=rows)
    with refused("`drop_flagged_rows`", "no row"):
        without_flagged_rows([arm_log], model(arm_log), [everything])


def test_what_is_accepted_is_not_refused():
    found = [DataFinding("axes", "wrong", "turn them", Severity.REFUSE)]
    with refused("`accept_findings` axes"):
        refuse(found)
    refuse(found, ["axes"])
    refuse([DataFinding("late", "by a row", "shift it")])


def test_rows_read_as_ranges():
    found = DataFinding("spikes", "fy", "look", rows={"log/episode_0001": (3, 4, 5, 9)})
    assert found.text == "spikes: fy (log/episode_0001 row 3 to 5, 9); look"
    assert found.to_mapping()["rows"] == {"log/episode_0001": [3, 4, 5, 9]}


def test_a_sign_is_wrong_where_a_scale_is_about_minus_one() -> None:
    assert [f.kind for f in sign_findings("q", -1.05, DEFAULT_DATA_SETTINGS)] == [
        "axes"
    ]
    for scale in (1.0, -57.3, -0.017):
        assert not sign_findings("q", scale, DEFAULT_DATA_SETTINGS)
