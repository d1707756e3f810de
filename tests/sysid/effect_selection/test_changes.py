"""What has changed since reference logs, on simulated logs of a small arm."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import (
    JointCoulombFriction,
    JointViscousFriction,
    TorqueOffset,
)
from sysid.effect_selection.change_words import changes_mapping, changes_text
from sysid.effect_selection.changes import Changes, find_changes
from sysid.models.joint_motion import JointMotionModel
from sysid.report import changes_page
from tests.sysid.models.two_logs import two_logs
from tests.sysid.report.pages import own_part

LIBRARY = (
    "JointCoulombFriction", "JointViscousFriction", "TorqueOffset", "TorqueGain"
)  # fmt: skip
_FRICTION = [
    JointCoulombFriction("shoulder", 1.0),
    JointViscousFriction("shoulder", 0.3),
    JointCoulombFriction("elbow", 0.8),
    JointViscousFriction("elbow", 0.2),
]


def changes(folder, added, since=0) -> Changes:
    logs = two_logs(folder, _FRICTION, added, since, rows=500)
    return find_changes(JointMotionModel(logs), 1)


def values(found: Changes) -> dict[str, tuple[float, tuple[float, float]]]:
    return {v.name: (v.value, v.interval) for v in found.closed.verdict.values}


def test_nothing_changed(tmp_path):
    found = changes(tmp_path, [])
    assert found.closed.verdict.names == ()
    assert not found.leaves_more
    assert "Nothing has changed" in changes_text(found)
    limits = {x.effect: x.amplitude for x in found.closed.verdict.limits}
    assert limits["JointCoulombFriction.elbow"] < 0.1


def test_references_that_differ_are_named(tmp_path):
    added = [TorqueOffset("elbow", 0.5)]
    [first, second] = two_logs(tmp_path / "a", _FRICTION, added, rows=300)
    [_, newer] = two_logs(tmp_path / "b", _FRICTION, added, rows=300)
    text = changes_text(find_changes(JointMotionModel([first, second, newer]), 2))
    assert "The references already differ" in text
    assert "from log_1/episode_0000 by an offset of the torque" in text


def test_a_friction_that_fell_is_told_by_how_much(tmp_path):
    found = changes(tmp_path, [JointCoulombFriction("elbow", -0.3)])
    assert found.closed.verdict.confirmed == ("JointCoulombFriction.elbow",)
    value, (low, high) = values(found)["JointCoulombFriction.elbow.size"]
    assert value == pytest.approx(-0.3, abs=0.02)
    assert low <= -0.3 <= high
    assert found.onset is None


def test_many_references_hide_no_change(tmp_path):
    logs = two_logs(tmp_path, _FRICTION, [JointCoulombFriction("elbow", 0.014)])
    names = [f"reference_{n}" for n in range(5)]
    references = [dataclasses.replace(logs[0], folder=tmp_path / n) for n in names]
    found = find_changes(JointMotionModel([*references, logs[1]]), 5)
    assert found.closed.verdict.names == ("JointCoulombFriction.elbow",)


def test_an_offset_that_jumps_within_the_log_has_a_row(tmp_path):
    found = changes(tmp_path, [TorqueOffset("shoulder", 0.5)], since=290)
    assert found.closed.verdict.names == ("TorqueOffset.shoulder",)
    assert found.onset is not None
    assert abs(found.onset.row - 290) <= 2 * found.onset.rows
    value, _ = values(found)["TorqueOffset.shoulder.size"]
    assert value == pytest.approx(0.5, abs=0.05)
    assert f"since rows {found.onset.row}" in changes_text(found)


def test_a_friction_that_fell_has_a_course(tmp_path):
    first = two_logs(tmp_path / "a", _FRICTION, [JointCoulombFriction("elbow", -0.3)])
    second = two_logs(tmp_path / "b", _FRICTION, [JointCoulombFriction("elbow", -0.5)])
    found = find_changes(JointMotionModel([*first, second[1]]), 1)
    sizes = [
        value.value
        for course in found.courses
        for value in course.values
        if value.name == "JointCoulombFriction.elbow.size"
    ]
    assert sizes == pytest.approx([-0.3, -0.5], abs=0.03)
    plain = changes_mapping(found)
    assert {each["episode"] for each in plain["courses"]} == {"log_1/episode_0000"}
    assert np.isfinite(plain["errors"]["relative"]["after"])
    assert "From log to log" in own_part(changes_page(found, {}))
