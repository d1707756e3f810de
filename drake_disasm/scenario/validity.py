"""Checks of scenarios: values within bounds, and consistent with each other."""

import os

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import check
from drake_disasm.common.text import clipped
from drake_disasm.effects import files_of, find_effect
from drake_disasm.parts import AXES
from drake_disasm.scenario.randomisation import corner, refuse_broken_ranges
from drake_disasm.scenario.schema import (
    CartesianImpedanceConfig,
    GripperConfig,
    Scenario,
)

#: Devices of the stations besides the arm.
_OTHER_DEVICES = ("gripper", "ft_sensor", "bolt")
#: Of Cartesian impedance control along the axes [N/m] and about them [N m/rad].
_STIFFNESS = (("N/m along", 10.0, 5000.0), ("N m/rad about", 1.0, 300.0))


def validate(scenario: Scenario) -> None:
    """Checks a scenario, however it was made.

    Raises:
        DisasmError: names the first field that is out of bounds or does not fit
            another, and the remedy.
    """
    _validate_one(scenario)
    refuse_broken_ranges(scenario)
    for name in ("low", "high") if scenario.randomisation else ():
        try:
            _validate_one(corner(scenario, name))
        except DisasmError as error:
            raise DisasmError(
                f"randomisation: with every {name} end, {error}"
            ) from None


def _validate_one(scenario: Scenario) -> None:
    """Checks the scenario of one diagram, without its ranges."""
    check(scenario)
    _refuse_unregistered(scenario)
    _refuse_missing_files(scenario)
    _refuse_broken_periods(scenario)
    _refuse_unfit_name(scenario.arm.name)
    _refuse_impossible_stiffness(scenario.arm.cartesian_impedance)
    scenario.part.refuse_impossible()
    _refuse_unreachable_end(scenario)
    _refuse_small_angles(scenario)
    _refuse_other_fingers(scenario.gripper)


def _refuse_unregistered(scenario: Scenario) -> None:
    for number, effect in enumerate(scenario.effects):
        try:
            known = find_effect(type(effect).__name__)
        except DisasmError as error:
            raise DisasmError(f"effects.{number}: {error}") from None
        if type(effect) is not known:
            raise DisasmError(
                f"effects.{number}: {known.__name__} has been registered again since "
                "this one was made; make it again"
            )


def _refuse_missing_files(scenario: Scenario) -> None:
    for number, effect in enumerate(scenario.effects):
        for field, file in files_of(effect).items():
            if not effect.is_null and not os.path.isfile(file):
                raise DisasmError(
                    f"effects.{number}.{field}: {clipped(file, 200)}: no such file; "
                    "name the one that closing the loop wrote beside its scenario"
                )


def _refuse_broken_periods(scenario: Scenario) -> None:
    steps = {
        "simulation.cell_time_step": scenario.simulation.cell_time_step,
        "simulation.twin_time_step": scenario.simulation.twin_time_step,
        "arm.control_period": scenario.arm.control_period,
    }
    for name, step in steps.items():
        count = scenario.task.period / step
        if abs(count - round(count)) > 1e-6:
            raise DisasmError(
                f"{name}: task.period ({scenario.task.period:g} s) is not a whole "
                f"number of {step:g} s; give a divisor of it"
            )


def _refuse_unfit_name(name: str) -> None:
    """Refuses an arm's name that no port can begin with."""
    if not name.isidentifier() or name in _OTHER_DEVICES:
        raise DisasmError(
            f"arm.name: '{clipped(name)}' is empty, another device's, or no word; give "
            "one of letters, digits and _, such as ur5e"
        )


def _refuse_impossible_stiffness(config: CartesianImpedanceConfig) -> None:
    """The first three and the last three are of different units."""
    for axis, k in enumerate(config.stiffness):
        words, low, high = _STIFFNESS[axis // 3]
        if not low <= k <= high:
            raise DisasmError(
                f"arm.cartesian_impedance.stiffness: {k:g} {words} {'xyz'[axis % 3]} "
                f"is out of range; give a value from {low:g} to {high:g}"
            )


def _refuse_unreachable_end(scenario: Scenario) -> None:
    task, stage = scenario.task, scenario.part.stages[0]
    end = stage.radius * stage.end
    if (task.success == "travelled" or stage.is_turn) and task.travel_success >= end:
        raise DisasmError(
            f"task.travel_success: the way along {AXES[stage.axis]} ends after "
            f"{end:g} m, {task.travel_success:g} m is never reached; give less"
        )


def _refuse_small_angles(scenario: Scenario) -> None:
    """The thesis's equations are those of a sensor that moves with the bolt."""
    if scenario.ft_sensor.place == "part" and scenario.observation.variant != "exact":
        raise DisasmError(
            "observation.variant: 'small_angle' is for a sensor that moves with the "
            "bolt; set it to exact, or ft_sensor.place to wrist"
        )


def _refuse_other_fingers(gripper: GripperConfig) -> None:
    if len(gripper.fingers) not in (0, 2):
        raise DisasmError(
            f"gripper.fingers: {len(gripper.fingers)} given; name two sliding joints, "
            "or none ([]) for a tool that has none, such as a suction cup"
        )
    if not gripper.fingers and gripper.compliance == "rigid":
        raise DisasmError(
            "gripper.compliance: 'rigid' is of fingers, and gripper.fingers is empty; "
            "raise gripper.stiffness instead"
        )
