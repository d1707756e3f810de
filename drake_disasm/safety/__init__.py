"""What stands between the diagram and the robot: limits, guards, and the hold."""

from drake_disasm.safety.guards import Guard, Situation, guards
from drake_disasm.safety.lag import Lag, LagMonitor
from drake_disasm.safety.limits import SafetyConfig
from drake_disasm.safety.pacing import Pace
from drake_disasm.safety.retreat import Retreat
from drake_disasm.safety.supervisor import Mode, Supervisor

__all__ = [
    "Guard",
    "Lag",
    "LagMonitor",
    "Mode",
    "Pace",
    "Retreat",
    "SafetyConfig",
    "Situation",
    "Supervisor",
    "guards",
]
