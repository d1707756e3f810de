"""An arm in free space, as what is diagnosed."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from drake_disasm.common.progress import Progress, ignore_progress
from drake_disasm.effects import Effect
from drake_disasm.experiments import (
    JointExcitation,
    JointExperiment,
    JointPlan,
    registered_joint_experiments,
)
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.logs import LogHeader
from sysid.diagnosis.arm_log import KINDS, Arm, GrowingArmLog
from sysid.diagnosis.design import Prediction, is_enough, predict
from sysid.diagnosis.in_free_space import (
    ArmRival,
    arm_forecasts,
    hazard_without_effects,
)
from sysid.diagnosis.loop import DEFAULT_BUDGET, Budget, Confirm, Diagnosis, pursue
from sysid.diagnosis.rivals import NOTHING, Need, Rival, open_rivals
from sysid.diagnosis.subject import Subject
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.effect_names import short_names
from sysid.experiment_design.information import arm_effects
from sysid.experiment_design.separating import SeparatingMotion
from sysid.workers import Workers

_WAY = 15.0  # s, to where a motion begins


def diagnose_arm(
    arm: Arm,
    space: ArmSpace,
    header: LogHeader,
    folder: Path,
    *,
    kind: str = KINDS[0],
    budget: Budget = DEFAULT_BUDGET,
    experiments: Sequence[type[JointExperiment]] | None = None,
    effects: Sequence[type[Effect]] | None = None,
    confirm: Confirm = lambda _: True,
    workers: Workers | None = None,
    progress: Progress = ignore_progress,
) -> Diagnosis:
    """Finds out what the model of an arm lacks, by motions in free space.

    As `diagnose` does in contact. The same call goes on where it was stopped. Of your
    own robot:

        limits = JointLimits.of_urdf(urdf, joints, acceleration=5.0, margin=0.1)
        space = ArmSpace.of(limits, CollisionFreeSpace(urdf, joints, limits, 0.02))
        header = LogHeader("joint_response", "swing", {}, urdf=urdf, joints=joints)
        diagnose_arm(robot, space, header, Path("out/arm"))

    Args:
        arm: that plays the motions.
        space: in which.
        header: of their recordings, of kind `joint_response`: it names the URDF.
        folder: of recordings, log, fits and `diagnosis.json`.
        kind: of the log that is judged: joint_motion or joint_response.
        budget: after which no experiment begins.
        experiments: to choose from; all registered ones if left out.
        effects: that may be named; all registered ones if left out.
        confirm: is asked before each experiment.
        workers: fit.
        progress: gets each step.

    Raises:
        DisasmError: see `diagnose`.
    """
    log = GrowingArmLog(arm, space, header, folder, kind, progress)
    subject = ArmSubject(log, experiments, effects, progress)
    return pursue(subject, folder, budget, confirm, workers or Workers())


class ArmSubject(Subject):
    """An arm in free space; see `diagnose_arm` for the arguments."""

    def __init__(
        self,
        log: GrowingArmLog,
        experiments: Sequence[type[JointExperiment]] | None,
        effects: Sequence[type[Effect]] | None,
        progress: Progress,
    ) -> None:
        settings = {"kind": log.kind, "joints": list(log.header.joints)}
        super().__init__(log, effects, settings)
        self._log, self._progress = log, progress
        known = registered_joint_experiments()
        self._kinds = known if experiments is None else experiments

    def first(self) -> list[JointPlan]:
        """See Subject."""
        return [JointExcitation().plan(self._log.space)]

    def foreseen(self, plans: Sequence[JointPlan]) -> list[tuple[float, str]]:
        """See Subject."""
        header, space = self._log.header, self._log.space
        return [
            (
                float(plan.motion.time[-1]) + _WAY,
                hazard_without_effects(plan, header, space),
            )
            for plan in plans
        ]

    def plans(self) -> list[JointPlan]:
        """See Subject."""
        space = self._log.space
        return [e.plan(space) for kind in self._kinds for e in kind.variants()]

    def rivals(
        self,
        closed: ClosedLoop,
        workers: Workers,
        fits: Path | None,
        asked: Sequence[tuple[str, ...]],
    ) -> tuple[Rival, ...]:
        """See Subject."""
        model = self._log.model()
        left = open_rivals(closed, model, ArmRival.of, workers, fits, asked)
        if left:
            return left
        name = short_names(closed.verdict.confirmed) or NOTHING
        return (ArmRival.of(name, closed.last, 1.0, 0.0),)

    def predict(
        self,
        plans: Sequence[JointPlan],
        rivals: Sequence[Rival],
        need: Need,
        trust: Mapping[str, float],
        done: Collection[str],
    ) -> list[Prediction]:
        """See Subject."""
        forecasts = partial(
            arm_forecasts,
            space=self._log.space,
            log=self._log.log(),
            progress=self._progress,
        )
        found = predict(plans, rivals, need, forecasts, trust)
        if is_enough(found, rivals, need, math.inf):
            return found
        more = [plan for plan in self._designed(rivals) if plan.text not in done]
        found += predict(more, rivals, need, forecasts, trust)
        return sorted(found, key=lambda each: -each.value)

    def _designed(self, rivals: Sequence[Rival]) -> Iterator[JointPlan]:
        """Yields the motion that is designed to separate the first two rivals.

        If they differ by one kind of effect each.
        """
        one, other = (
            {type(e.effect).__name__ for e in rival.effects}
            for rival in rivals[:2]
            if isinstance(rival, ArmRival)
        )
        pair = sorted(one ^ other)
        if len(one - other) == len(other - one) == 1 and {*pair} <= {*arm_effects()}:
            motion = SeparatingMotion(pair[0], pair[1], str(self._log.header.urdf))
            yield motion.plan(self._log.space)
