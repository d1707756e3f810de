"""Scenarios: typed YAML files, each of which defines one diagram.

`load_scenario` reads a file (strictly: an unknown key is an error), applies
overrides such as `part.clearance=0.0003`, and checks every value against its
bounds and against the others. All values are SI.
"""

from drake_disasm.scenario.files import (
    dump_scenario,
    load_scenario,
    scenario_from_mapping,
    scenario_path,
    scenario_to_mapping,
    shipped_scenarios,
    with_hidden_effects,
)
from drake_disasm.scenario.randomisation import corner, draw, with_values
from drake_disasm.scenario.schema import (
    CONTROLS,
    ArmConfig,
    CartesianImpedanceConfig,
    GripperConfig,
    JointImpedanceConfig,
    ObservationConfig,
    PlacementConfig,
    Range,
    RewardConfig,
    Scenario,
    SensorConfig,
    SimulationConfig,
    TaskConfig,
)
from drake_disasm.scenario.validity import validate

__all__ = [
    "CONTROLS",
    "ArmConfig",
    "CartesianImpedanceConfig",
    "GripperConfig",
    "JointImpedanceConfig",
    "ObservationConfig",
    "PlacementConfig",
    "Range",
    "RewardConfig",
    "Scenario",
    "SensorConfig",
    "SimulationConfig",
    "TaskConfig",
    "corner",
    "draw",
    "dump_scenario",
    "load_scenario",
    "scenario_from_mapping",
    "scenario_path",
    "scenario_to_mapping",
    "shipped_scenarios",
    "validate",
    "with_hidden_effects",
    "with_values",
]
