"""Files of learned functions for tests."""

from pathlib import Path

import numpy as np

from drake_disasm.effects import SensorResidualModel
from drake_disasm.effects.learned import BoostedTrees, LearnedFunctions

HEIGHT = 2.5  # what a step is high


def step_above_zero(inputs: int, which: int, low: float, high: float) -> BoostedTrees:
    """Returns a function that is 2.5 where an input is above zero, else 0."""
    return BoostedTrees(
        np.array([[which, -1, -1]]),
        np.zeros((1, 3)),
        np.array([[[1, 2], [1, 1], [2, 2]]]),
        np.array([[0.0, 0.0, HEIGHT]]),
        np.array(0.0),
        np.full(inputs, low),
        np.full(inputs, high),
    )


def step_in_fy(folder: Path) -> Path:
    """Writes a learned function of fy that is a step in fx."""
    path = folder / "model.npz"
    outputs = {"fy": step_above_zero(10, 0, -20.0, 20.0)}
    LearnedFunctions(SensorResidualModel.inputs, outputs).save(path)
    return path
