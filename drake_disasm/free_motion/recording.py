"""The log of motions that the cell's arm plays."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_disasm.cell.arm_model import arm_joints
from drake_disasm.logs import LogHeader
from drake_disasm.scenario import Scenario, scenario_to_mapping

#: Of arm and tool, beside the log.
URDF = "arm.urdf"

#: What is known of the drives: of the simulated ones all, of KUKA's this.
_SIMULATED = {"gravity_compensation": True, "velocity_feedforward": True}
_REAL = {"gravity_compensation": True}


def response_header(
    scenario: Scenario, folder: Path, station: str, provenance: Mapping[str, Any]
) -> LogHeader:
    """Returns the header of a log of commanded and measured positions.

    Args:
        scenario: that the log states.
        folder: of the log.
        station: "cell" or "hardware".
        provenance: command, date, versions, commit; the station is added.
    """
    is_real = station == "hardware"
    return LogHeader(
        kind="joint_response",
        task="free motion",
        provenance=dict(provenance) | {"simulated": not is_real, "station": station},
        period=scenario.arm.control_period,
        joints=arm_joints(scenario.arm),
        urdf=str((folder / URDF).absolute()),
        drive=_REAL if is_real else _SIMULATED,
        scenario=scenario_to_mapping(scenario),
    )
