"""Models that predict a log's measured channels under parameters.

One interface, `LogModel`, for every kind of log: transitions and rollouts of the
twin, static readings of a force/torque sensor, joint torques of an arm.
"""

from sysid.models.base import (
    Channel,
    LogModel,
    Measurements,
    PredictionError,
    ScenarioModel,
)

__all__ = ["Channel", "LogModel", "Measurements", "PredictionError", "ScenarioModel"]
