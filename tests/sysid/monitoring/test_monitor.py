"""A watch of a sensor's readings, a log each day."""

import json

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import read_log
from sysid.monitoring.episodes import Course
from sysid.monitoring.monitor import OWN, Monitor
from sysid.monitoring.page import monitor_page
from sysid.monitoring.record import Record
from sysid.monitoring.reference import KEY, Reference
from sysid.monitoring.watched import WatchedFolder
from tests.sysid.models.arm import smooth_motion, write_motion_log, write_two_link_arm
from tests.sysid.monitoring.days import write_day, write_reference

_LEVEL = 30.0
LIBRARY = ("SensorBias", "SensorDrift", "SensorGain", "SensorMounting", "PayloadError")


@pytest.fixture(scope="module")
def closed(tmp_path_factory):
    """Output of the closed loop of six days."""
    return write_reference(tmp_path_factory.mktemp("reference"))


@pytest.fixture(scope="module")
def begun(closed):
    """A monitor that knows the reference alone, as an archive."""
    monitor = Monitor.of(Reference.read(closed), _LEVEL)
    return monitor.reference, monitor.to_archive()


def fresh(begun) -> Monitor:
    reference, archive = begun
    return Monitor.from_archive(reference, *archive, _LEVEL)


def test_a_bias_that_has_changed_is_named_dated_and_measured(begun, tmp_path):
    monitor = fresh(begun)
    biases = [0.0, 0.0, 0.2, 0.2, 0.2, 0.2]
    said = None
    for day, bias in enumerate(biases):
        said = monitor.judge(read_log(write_day(tmp_path / f"day_{day}", day, bias)))
        if said.is_alarm:
            break
    assert said and said.is_alarm and said.number > 3
    first = said.suspects[0].to_mapping()
    assert first["parameter"] == "SensorBias.fx"
    assert first["since"] == "day_2/episode_0000"
    assert first["interval_95"][0] < 0.2 < first["interval_95"][1]
    assert str(tmp_path / "day_2") in said.command
    assert str(tmp_path / "day_1") not in said.command
    assert all(str(folder) in said.command for folder in monitor.reference.logs)
    assert "offset of the sensor" in said.sentence
    page = monitor_page(monitor, tmp_path, {})
    assert "Alarm at episode" in page and len(page) < 10**6


def test_the_reference_is_judged_as_if_it_had_not_been_fitted(begun, closed):
    """Its residuals are as large as those of new days, not smaller."""
    monitor = fresh(begun)
    logs = monitor.reference.read_logs()
    fitted = monitor.statistics.of_episode(logs[0]).values[-6:]
    left_out = monitor.baseline.values[0, -6:]
    assert np.all(left_out > fitted)


def test_loose_ends_are_skipped_with_a_reason(begun, tmp_path):
    monitor = fresh(begun)
    short = read_log(write_day(tmp_path / "short", 0, rows=9))
    monitor.judge(read_log(write_day(tmp_path / "day", 1)))
    said = monitor.judge(short)
    assert said.role == "skipped" and "rows" in said.reason
    assert monitor.starts == 1


def test_another_robot_is_refused(begun, tmp_path):
    urdf, time = write_two_link_arm(tmp_path / "arm.urdf"), 0.01 * np.arange(50)
    q, v, vd = smooth_motion(time)
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": q}
    log = write_motion_log(tmp_path / "arm", urdf, columns)
    with pytest.raises(DisasmError, match="kind is joint_motion"):
        fresh(begun).judge(log)


def test_few_or_far_longer_episodes_leave_the_reference_to_the_first_new_ones(
    begun, tmp_path
):
    monitor = fresh(begun)
    assert monitor.has_own_reference and not monitor.missing
    first = monitor.judge(read_log(write_day(tmp_path / "day", 0, rows=11)))
    assert first.role == "reference" and monitor.missing == 2
    assert not monitor.has_own_reference


def test_an_output_of_another_layout_is_refused(closed, tmp_path):
    content = json.loads((closed / "result.json").read_text())
    for change in ({"layout": 0}, {"values": None}, {"written": ["CommonDelay"]}):
        other = {KEY: content[KEY] | change}
        (tmp_path / "result.json").write_text(json.dumps(other))
        with pytest.raises(DisasmError, match="close the loop again"):
            Reference.read(tmp_path)
    (tmp_path / "result.json").write_text(json.dumps({"courses": []}))
    with pytest.raises(DisasmError, match="comparison"):
        Reference.read(tmp_path)


def test_a_reference_whose_logs_changed_is_refused(tmp_path):
    closed = write_reference(tmp_path, days=2)
    reference = Reference.read(closed)
    again = Reference.from_mapping(json.loads(json.dumps(reference.to_mapping())))
    assert again.to_mapping() == reference.to_mapping()
    log = next(iter(reference.logs))
    (log / "episode_0000.parquet").unlink()
    write_day(tmp_path / "other", 7)
    (tmp_path / "other" / "episode_0000.parquet").rename(log / "episode_0000.parquet")
    with pytest.raises(DisasmError, match="has changed"):
        reference.read_logs()


def test_a_watch_goes_on_where_it_was_killed(begun, closed, tmp_path):
    days, out = tmp_path / "days", tmp_path / "out"
    days.mkdir()
    for day in range(3):
        write_day(days / f"day_{day}", day)

    def _opened() -> Record:
        return Record.open(out, begun[0], days, _LEVEL, {})

    def _judge(record: Record, most: int) -> None:
        for arrival, _ in zip(record.watched.arrivals(), range(most), strict=False):
            record.watched.take(arrival)
            assert arrival.log is not None
            record.keep(record.monitor.judge(arrival.log))

    _judge(_opened(), 2)
    lines = (out / "episodes.jsonl").read_text()
    with (out / "episodes.jsonl").open("a") as stream:
        stream.write('{"number": 3, "lo')  # killed here
    record = _opened()
    assert record.watched.last == {"day_0": 0, "day_1": 0}
    _judge(record, 9)
    whole = (out / "episodes.jsonl").read_text()
    assert whole.startswith(lines) and len(whole.splitlines()) == 3
    at_once = fresh(begun)
    for day in range(3):
        said = at_once.judge(read_log(days / f"day_{day}"))
    last = json.loads(whole.splitlines()[-1])
    assert last["log10_evidence"] == pytest.approx(said.log10_evidence)
    other = tmp_path / "other"
    other.mkdir()
    with pytest.raises(DisasmError, match="another log"):
        Record.open(out, begun[0], other, _LEVEL, {})


def test_a_log_that_grows_gives_each_episode_once(tmp_path):
    folder = write_day(tmp_path / "log", 0)
    watched = WatchedFolder(folder)
    [first] = watched.arrivals()
    watched.take(first)
    assert list(watched.arrivals()) == []
    write_day(tmp_path / "next", 1)
    (tmp_path / "next" / "episode_0000.parquet").rename(folder / "episode_0001.parquet")
    [second] = watched.arrivals()
    assert second.number == 1 and second.log is not None
    assert [e.name for e in second.log.episodes] == ["episode_0001"]


def test_half_written_logs_are_waited_for_and_damaged_ones_said(tmp_path):
    folder = write_day(tmp_path / "days" / "day_0", 0)
    path = folder / "episode_0000.parquet"
    whole = path.read_bytes()
    path.write_bytes(whole[:200])
    (tmp_path / "days" / "day_1").mkdir()  # no log yet
    assert list(WatchedFolder(tmp_path / "days", waits=True).arrivals()) == []
    [damaged] = WatchedFolder(tmp_path / "days").arrivals()
    assert damaged.log is None and "episode_0000.parquet" in damaged.error
    path.write_bytes(whole)
    [read] = WatchedFolder(tmp_path / "days").arrivals()
    assert read.log is not None
    with pytest.raises(DisasmError, match="is gone"):
        list(WatchedFolder(tmp_path / "gone").arrivals())


def test_the_course_keeps_its_peaks_in_bounded_length():
    course = Course(np.zeros((0, 2)))
    for number in range(5000):
        course.add(number, 9.0 if number == 1234 else 0.0)
    assert len(course.points) <= 2000
    assert [1234.0, 9.0] in course.points.tolist()


def test_names_of_the_reference_can_not_be_those_of_logs(begun):
    assert all(name.startswith(OWN) for name in fresh(begun).baseline.names)
