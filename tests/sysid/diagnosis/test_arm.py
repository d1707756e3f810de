"""An arm in free space finds out what its model lacks: a simulated pendulum."""

import dataclasses
import html
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.progress import ignore_progress
from drake_disasm.effects import (
    JointCoulombFriction,
    JointStribeckFriction,
    JointViscousFriction,
)
from drake_disasm.experiments import JointExcitation, JointStrokes
from drake_disasm.logs import read_log
from drake_disasm.stations.hardware import HoldError
from sysid.diagnosis import GrowingArmLog, Need, diagnose_arm, predict
from sysid.diagnosis.arm_subject import ArmSubject
from sysid.diagnosis.in_free_space import ArmRival, arm_forecasts
from sysid.fitting.candidates import Candidate
from sysid.report import diagnosis_page
from tests.refusals import refused
from tests.sysid.diagnosis.arms import JOINT, Pendulum

FRICTION = (JointCoulombFriction, JointStribeckFriction, JointViscousFriction)
DRY = JointCoulombFriction(joint=JOINT, size=0.15)
STRIBECK = JointStribeckFriction(joint=JOINT, size=0.15, speed=0.05)


def told(arm: Pendulum, folder: Path, **more: object):
    return diagnose_arm(arm, arm.space, arm.header(), folder, effects=FRICTION, **more)


@pytest.mark.parametrize(
    "kind", ["joint_motion", pytest.param("joint_response", marks=pytest.mark.slow)]
)
def test_it_ends_with_what_is_hidden(tmp_path: Path, kind: str) -> None:
    arm = Pendulum(tmp_path, STRIBECK, is_stiff=kind == "joint_motion")
    found = told(arm, tmp_path / "out", kind=kind)
    assert found.is_settled and found.names == (f"JointStribeckFriction.{JOINT}",)
    log = read_log(tmp_path / "out" / "motions")
    assert len(log.episodes) == 1 + sum(bool(r.experiment) for r in found.rounds)
    page = html.unescape(diagnosis_page(found, {}))
    assert "settled: the model lacks JointStribeckFriction.servo" in page
    again = told(arm, tmp_path / "out", kind=kind)
    assert again.robot_time == found.robot_time
    with refused("another kind"):
        other = {"joint_motion": "joint_response", "joint_response": "joint_motion"}
        told(arm, tmp_path / "out", kind=other[kind])


def test_the_first_motion_is_looked_at_by_the_urdf(tmp_path: Path) -> None:
    arm = Pendulum(tmp_path, DRY)
    weak = dataclasses.replace(arm.space.limits, effort=np.array([1e-3]))
    arm.space = dataclasses.replace(arm.space, limits=weak)
    with refused("is not performed", "servo takes", "of what is allowed"):
        told(arm, tmp_path / "out")
    assert not arm.played


def rivals(**values: float) -> list[ArmRival]:
    """Dry friction and friction that falls with speed, of about the same size."""
    found = []
    for effect, own in (
        (DRY, {"size": 0.15, "creep": 0.02}),
        (STRIBECK, {"size": 0.15, "creep": 0.02, "speed": 0.05}),
    ):
        candidate = Candidate.of(type(effect)(joint=JOINT))
        named = {f"{candidate.name}.{k}": v for k, v in own.items()}
        sigma = np.array([0.01])
        found.append(
            ArmRival(candidate.name, 0.5, 0.0, (candidate,), values | named, sigma)
        )
    return found


def test_slow_and_fast_strokes_show_what_falls_with_speed(tmp_path: Path) -> None:
    """At a twentieth of the film's speed both rub alike."""
    arm = Pendulum(tmp_path, DRY)
    log = GrowingArmLog(arm, arm.space, arm.header(), tmp_path / "out")
    log.perform(JointExcitation(5.0).plan(arm.space))
    model = log.model()
    base = {p.name: p.nominal for p in model.parameters}
    plans = [JointStrokes(speed=speed).plan(arm.space) for speed in (0.005, 0.05, 0.1)]
    forecasts = partial(arm_forecasts, space=arm.space, log=log.log())
    found = predict(plans, rivals(**base), Need(25.0), forecasts)
    slowest, slow, fast = (
        next(each for each in found if each.plan is plan).farthest for plan in plans
    )
    assert fast > slow > 3.0 * slowest
    shown = found[0].forecast
    assert shown.channel == JOINT and shown.unit == "N m" and not shown.hazard


def test_what_a_joint_can_not_give_is_a_hazard(tmp_path: Path) -> None:
    arm = Pendulum(tmp_path, DRY)
    log = GrowingArmLog(arm, arm.space, arm.header(), tmp_path / "out")
    log.perform(JointExcitation(5.0).plan(arm.space))
    base = {p.name: p.nominal for p in log.model().parameters}
    heavy, other = rivals(**base)
    heavy.values[f"{heavy.name}.size"] = 4.0
    plan = JointStrokes(speed=0.1).plan(arm.space)
    [found] = arm_forecasts([plan], [heavy, other], arm.space, log.log())
    assert f"under {heavy.name} {JOINT} takes" in found.hazard


def test_rows_before_a_hold_are_kept_and_the_next_call_goes_on(tmp_path: Path) -> None:
    arm = Pendulum(tmp_path, STRIBECK, holds_at=0)
    with pytest.raises(HoldError):
        told(arm, tmp_path / "out")
    [half] = read_log(tmp_path / "out" / "motions").episodes
    assert half["time"][-1] == pytest.approx(10.0, abs=0.02)
    arm.resume()
    assert told(arm, tmp_path / "out").is_settled


def test_a_motion_is_designed_where_the_library_has_none(tmp_path: Path) -> None:
    """A pendulum of the library's slowest strokes alone, far below the film's speed."""
    arm = Pendulum(tmp_path, DRY)
    log = GrowingArmLog(arm, arm.space, arm.header(), tmp_path / "out")
    log.perform(JointExcitation(5.0).plan(arm.space))
    base = {p.name: p.nominal for p in log.model().parameters}
    subject = ArmSubject(log, [], FRICTION, ignore_progress)
    [designed] = subject.predict([], rivals(**base), Need(25.0), {}, ())
    assert designed.plan.text.startswith("SeparatingMotion(JointCoulombFriction, ")
    assert designed.farthest > 5.0 and not designed.hazard
    ends = designed.plan.motion.q[[0, -1]]
    np.testing.assert_allclose(ends, [arm.space.home] * 2, atol=1e-4)
    log.perform(designed.plan)
    assert log.episodes == 2
