"""Torques that are none of their joints', of a log that has no finding."""

import numpy as np
from damaged_logs import both, damaged, scaled, swapped

from drake_disasm.logs import Log
from sysid.data_checks import check_data, refuse
from sysid.models.from_logs import ModelChoice, model_of
from tests.refusals import refused


def _texts(log: Log, **columns: np.ndarray) -> dict[str, str]:
    """Returns findings by kind of a log with other columns."""
    log = damaged(log, lambda own: own.update(columns))
    found = check_data([log], model_of([log], ModelChoice(fixed=True)))
    return {finding.kind: finding.text for finding in found}


def test_amperes_are_told_by_gravity(arm_log: Log) -> None:
    tau = arm_log.episodes[0]["tau"]
    found = _texts(arm_log, **{"tau.0": tau[:, 0] / 12.0, "tau.1": tau[:, 1] / 15.0})
    assert "motor currents" in found["units"]


def test_a_factor_of_all_joints_torques_is_refused(arm_log: Log) -> None:
    log = damaged(arm_log, scaled(1e3, "tau"))
    found = check_data([log], model_of([log], ModelChoice(fixed=True)))
    with refused("at all joints that tell", "`scale: 0.001` of tau in the map"):
        refuse(found)


def test_a_factor_of_one_joint_s_torque_may_be_a_placeholder_s(arm_log: Log) -> None:
    log = damaged(arm_log, scaled(1e3, "tau.0"))
    refuse(check_data([log], model_of([log], ModelChoice(fixed=True))))


def test_two_joints_whose_motions_are_exchanged_are_told(arm_log: Log) -> None:
    order = swapped("q.0", "q.1"), swapped("v.0", "v.1"), swapped("vd.0", "vd.1")
    log = damaged(arm_log, both(order[0], both(*order[1:])))
    found = check_data([log], model_of([log], ModelChoice(fixed=True)))
    with refused("q.0 (shoulder) and q.1 (elbow) are exchanged", "map of import-log"):
        refuse(found)


def test_another_joint_s_channel_is_told(arm_log: Log) -> None:
    found = _texts(arm_log, **{"tau.1": 1.1 * arm_log.episodes[0]["tau"][:, 0]})
    assert "elbow that of shoulder" in found["unrelated"]


def test_a_channel_without_any_motion_is_told(arm_log: Log) -> None:
    rows = arm_log.episodes[0].rows
    noise = np.random.default_rng(0).standard_normal(rows)
    assert "elbow nothing" in _texts(arm_log, **{"tau.1": noise})["unrelated"]


def test_speeds_beyond_the_urdf_s_limits_are_told(arm_log: Log) -> None:
    episode = arm_log.episodes[0]
    fast = {
        f"{name}.{joint}": 5.0**power * episode[name][:, joint]
        for power, name in enumerate(("q", "v", "vd"))
        for joint in range(2)
    }
    assert "beyond the limits" in _texts(arm_log, **fast)["limits"]
