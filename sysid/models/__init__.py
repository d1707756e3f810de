"""Models that predict a log's measured channels under parameters.

One interface, `LogModel`, for every kind of log: transitions and rollouts of the
twin, static readings of a force/torque sensor, joint torques of an arm, and models
of your own.
"""

from sysid.models.base import LogModel, PredictionError
from sysid.models.measurements import Channel, Measurements
from sysid.models.scenario_model import ScenarioModel

__all__ = ["Channel", "LogModel", "Measurements", "PredictionError", "ScenarioModel"]
