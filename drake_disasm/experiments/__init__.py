"""Experiments: motions by which a station finds out what its model lacks.

To add one to the library: a class in `motions`. To add one of your own from anywhere
else: `register_experiment`.
"""

from drake_disasm.experiments.base import FREE_SPACE, Experiment, Plan
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
# isort: on

__all__ = [
    "FREE_SPACE",
    "Approach",
    "Experiment",
    "LoadedStrokes",
    "Move",
    "Performer",
    "Phase",
    "Plan",
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
]
