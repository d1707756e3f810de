"""Whether to put a policy on the robot, judged on the corrected twin."""

from sysid.acceptance.acceptance import DRAWS, Acceptance, accept
from sysid.acceptance.corrected_twin import CorrectedTwin, with_intervals

__all__ = ["DRAWS", "Acceptance", "CorrectedTwin", "accept", "with_intervals"]
