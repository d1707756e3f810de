"""Experiments: motions by which a station finds out what its model lacks.

To add one to the library: a class in `motions`, or in `joint_motions` for an arm in
free space. To add one of your own from anywhere else: `register_experiment`.
"""

from drake_disasm.experiments.base import (
    FREE_SPACE,
    AnyExperiment,
    Experiment,
    JointExperiment,
    JointPlan,
    Plan,
)
from drake_disasm.experiments.performer import Performer
from drake_disasm.experiments.phases import (
    Approach,
    Move,
    Phase,
    Replay,
    Return,
    TakeOut,
    Wait,
)
from drake_disasm.experiments.registry import (
    find_experiment,
    register_experiment,
    registered_experiments,
    registered_joint_experiments,
)

# Experiments are registered and documented in the order of these lines.
# isort: off
from drake_disasm.experiments.motions import (
    Removal,
    Reversals,
    Strokes,
    Presses,
    RepeatedPresses,
    LoadedStrokes,
    SlowApproach,
    Rest,
    Weighing,
)
from drake_disasm.experiments.joint_motions import (
    JointExcitation,
    JointStrokes,
    PostureSteps,
)
# isort: on

__all__ = [
    "FREE_SPACE",
    "AnyExperiment",
    "Approach",
    "Experiment",
    "JointExcitation",
    "JointExperiment",
    "JointPlan",
    "JointStrokes",
    "LoadedStrokes",
    "Move",
    "Performer",
    "Phase",
    "Plan",
    "PostureSteps",
    "Presses",
    "Removal",
    "RepeatedPresses",
    "Replay",
    "Rest",
    "Return",
    "Reversals",
    "SlowApproach",
    "Strokes",
    "TakeOut",
    "Wait",
    "Weighing",
    "find_experiment",
    "register_experiment",
    "registered_experiments",
    "registered_joint_experiments",
]
