"""A single axis without a URDF: one unknown body, whatever its size."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.resources import ONE_JOINT_MODELS
from drake_disasm.effects import JointElasticity
from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log
from sysid.data_checks.check import check_data
from sysid.data_checks.finding import DataFinding, Severity
from sysid.models.joint_motion import JointMotionModel
from tests.refusals import refusal

_TIME = 0.005 * np.arange(2000)
_RATES, _SIZES = 2.0 * np.pi * np.array([0.2, 0.5, 0.9]), np.array([0.8, 0.4, 0.2])
_ANGLES = np.outer(_TIME, _RATES) + np.array([0.3, 1.1, 2.0])
_Q = np.sin(_ANGLES) @ _SIZES
_V = np.cos(_ANGLES) @ (_SIZES * _RATES)
_VD = -np.sin(_ANGLES) @ (_SIZES * _RATES**2)
_FRICTION = 0.3 * np.tanh(_V / 0.02) + 0.05 * _V
#: I, m x and m z of a pendulum about a level axis y.
_INERTIA, _MX, _MZ = 0.5, 0.1, -0.4


def _weight(q: np.ndarray) -> np.ndarray:
    """Returns the torque about y that holds the pendulum under Drake's gravity."""
    return -9.81 * (_MX * np.cos(q) + _MZ * np.sin(q))


def _log(folder: Path, tau: np.ndarray, urdf: str | None = None) -> Log:
    """Writes a log of one joint."""
    header = LogHeader("joint_motion", "swing", {}, joints=("hinge",), urdf=urdf)
    motion = {"time": _TIME, "q": _Q, "v": _V, "vd": _VD, "tau": tau}
    columns = {n: x if n == "time" else x[:, None] for n, x in motion.items()}
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_motion", columns))
    return read_log(folder)


def _nominal(log: Log) -> dict[str, float]:
    return {p.name: p.nominal for p in JointMotionModel([log]).parameters}


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_a_pendulum_s_inertia_and_weight_are_found(tmp_path: Path, size: float) -> None:
    tau = size * (_INERTIA * _VD + _weight(_Q) + _FRICTION)
    model = JointMotionModel([_log(tmp_path / "log", tau)])
    truth = {"body.Iyy": _INERTIA, "body.mx": _MX, "body.mz": _MZ}
    for parameter in model.parameters:
        expected = size * truth.pop(parameter.name)
        assert parameter.nominal == pytest.approx(expected, rel=0.05)
        assert parameter.low < -4.0 * abs(expected)
        assert parameter.high > 4.0 * abs(expected)
    assert not truth
    [assumed] = model.assumptions
    assert "the joint turns" in assumed.what and "unit: m" in assumed.remedy


def test_a_slide_has_a_mass_and_no_weight(tmp_path: Path) -> None:
    tau = 25.0 * _VD + 12.0 + _FRICTION
    log = _log(tmp_path / "log", tau, ONE_JOINT_MODELS["slides"])
    assert _nominal(log) == {"body.m": pytest.approx(25.0, rel=1e-3)}
    model = JointMotionModel([log])
    assert model.measurements.channels[0].unit == "N"


def _refused(log: Log) -> list[DataFinding]:
    findings = check_data([log], JointMotionModel([log]))
    return [f for f in findings if f.severity is Severity.REFUSE]


@pytest.mark.parametrize("urdf", [None, ONE_JOINT_MODELS["slides"]])
def test_torques_of_the_wrong_sign_are_found(tmp_path: Path, urdf: str | None) -> None:
    tau = _INERTIA * _VD + (_weight(_Q) if urdf is None else 0.0) + _FRICTION
    assert not _refused(_log(tmp_path / "right", tau, urdf))
    [finding] = _refused(_log(tmp_path / "wrong", -tau, urdf))
    assert finding.kind == "axes"


def test_a_gear_yields_under_the_body_that_was_found(tmp_path: Path) -> None:
    """As under that of a URDF of the same body."""
    tau = _INERTIA * _VD + _weight(_Q)
    path = tmp_path / "pendulum.urdf"
    path.write_text(
        '<robot name="p"><link name="world"/><link name="body"><inertial>'
        f'<origin xyz="{_MX / 2.0} 0 {_MZ / 2.0}"/><mass value="2"/><inertia '
        'ixx="0.4" ixy="0" ixz="0" iyy="0.415" iyz="0" izz="0.4"/></inertial></link>'
        '<joint name="hinge" type="continuous"><parent link="world"/>'
        '<child link="body"/><axis xyz="0 1 0"/></joint></robot>'
    )
    found = []
    for urdf in (None, str(path)):
        model = JointMotionModel([_log(tmp_path / f"log{len(found)}", tau, urdf)])
        model = model.with_effects([JointElasticity("hinge", compliance=1e-3)])
        theta = np.array([p.nominal for p in model.parameters])
        found.append(model.predict(theta, slice(None))[:, 0])
    np.testing.assert_allclose(*found, rtol=1e-4, atol=1e-4)
    assert np.abs(found[0] - tau).max() > 1e-3


def test_two_joints_need_a_urdf(tmp_path: Path) -> None:
    header = LogHeader("joint_motion", "swing", {}, joints=("a", "b"))
    two = np.column_stack([_Q, _V])
    columns = {"time": _TIME} | dict.fromkeys(("q", "v", "vd", "tau"), two)
    with LogWriter(tmp_path / "log", header) as writer:
        writer.write_episode(flat_columns("joint_motion", columns))
    message = refusal(JointMotionModel, [read_log(tmp_path / "log")])
    assert "no 'urdf'" in message and "by `urdf`" in message
