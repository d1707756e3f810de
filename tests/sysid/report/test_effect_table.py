"""Effects kind by kind, and what to record next."""

from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.verdict import ParameterValue, Tie
from sysid.report.effect_table import kind_rows
from sysid.report.next_recordings import limit_rows, recordings
from tests.sysid.effect_selection.verdicts import made_verdict


def _friction(joint, size):
    name = f"JointCoulombFriction.{joint}.size"
    return ParameterValue(name, size, "N m", (0.9 * size, 1.1 * size), 0.0)


def test_one_kind_of_effect_at_several_joints_is_one_row():
    names = ("JointCoulombFriction.j1", "SensorBias", "JointCoulombFriction.j2")
    bias = ParameterValue("SensorBias.fx", -0.2, "N", (-0.3, -0.1), 0.0)
    values = (_friction("j1", 0.5), _friction("j2", 0.7), bias)
    friction, offset = kind_rows(made_verdict("explained", names, values=values))
    assert friction.words == "dry friction" and friction.joints == ("j1", "j2")
    assert friction.equation.startswith("tau = c tanh(v / e)")
    assert "one joint of the arm" in friction.place
    (row,) = friction.rows
    assert {j: v.value for j, v in row.values.items()} == {"j1": 0.5, "j2": 0.7}
    assert (row.meaning, row.unit, row.is_signed) == ("friction torque", "N m", False)
    assert offset.joints == () and offset.rows[0].is_signed
    assert offset.rows[0].meaning == "force offset along x_S"


def test_an_effect_of_ones_own_that_is_not_known_has_a_row_too():
    value = ParameterValue("MyThing.size", 1.0, "N", (0.9, 1.1), 0.0)
    (row,) = kind_rows(made_verdict("explained", ("MyThing",), values=(value,)))
    assert row.words == "my thing" and row.rows[0].values[""] is value


def test_detection_limits_of_joints_are_one_row():
    limits = (
        DetectionLimit("TorqueOffset.j1", "size", 0.3, "N m", 0.1),
        DetectionLimit("TorqueOffset.j2", "size", -0.1, "N m", 0.1),
        DetectionLimit("TorqueOffset.j3", "size", None, "N m", 1.2),
        DetectionLimit("SensorBias", "fx", None, "N", 2.0),
        DetectionLimit("SensorWarmUp", "fx", 0.1, "N", 0.2, "time_constant=1"),
    )
    offset, bias, warm_up = limit_rows(limits)
    assert warm_up.shapes == ("time_constant=1",) and offset.shapes == ()
    assert (offset.least, offset.greatest) == ((0.1, "j2"), (0.3, "j1"))
    assert offset.hidden == ("j3",) and bias.least is None
    told = recordings(made_verdict("none", limits=limits), setting="")
    assert [each.purpose for each in told] == [
        "an offset of the sensor, which this log could not have shown"
    ]
    assert "readings in six" in told[0].what


def test_a_log_of_the_task_gets_recordings_of_the_task():
    limits = (DetectionLimit("SensorBias", "fx", None, "N", 2.0),)
    (told,) = recordings(made_verdict("none", limits=limits), setting="task")
    assert "readings" not in told.what


def test_what_separates_rivals_comes_first():
    ties = ((Tie("JointLoadFriction.j1", "two payloads"),),)
    found = made_verdict("unexplained", ("JointCoulombFriction.j1",), ties)
    first, second = recordings(found, setting="")
    assert first.purpose == (
        "whether it is dry friction or friction in proportion to the load"
    )
    assert first.what == "two payloads"
    assert second.purpose == "whether it is dry friction at all"
