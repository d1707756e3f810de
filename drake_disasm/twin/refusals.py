"""What a batch can't carry: one clear error each, before any work."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.lib import NumpyVersion

from drake_disasm.common.arrays import Array
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    ArmEffect,
    PoseEffect,
    SensorMemoryEffect,
    sensor_chain,
)
from drake_disasm.effects.refusals import (
    refuse_arm_effects,
    refuse_unknown_kinds,
    refuse_without_quantity,
)
from drake_disasm.scenario import Scenario, corner, validate

#: What all environments of a batch share, by the name of the field.
_SHARED: dict[str, Callable[[Scenario], Any]] = {
    "part": lambda s: type(s.part).__name__,
    "task.period": lambda s: s.task.period,
    "task.success": lambda s: s.task.success,
    "task.judged_by": lambda s: s.task.judged_by,
    "simulation.twin_time_step": lambda s: s.simulation.twin_time_step,
    "ft_sensor.period": lambda s: s.ft_sensor.period,
    "ft_sensor.place": lambda s: s.ft_sensor.place,
    "observation.variant": lambda s: s.observation.variant,
}


def make_like(device: str) -> Array:
    """Returns an empty array of the kind with which a device computes.

    Args:
        device: "numpy", or one of torch's: "cpu", "cuda", "cuda:1".

    Raises:
        DisasmError: there is no such device, or Numba can't compile for it.
    """
    if device == "numpy":
        return np.zeros(0)
    import torch

    try:
        like = torch.zeros(0, dtype=torch.float64, device=device)
    except (RuntimeError, AssertionError) as error:
        reason = " ".join(str(error).split(". ")[0].split())
        raise DisasmError(
            f"device: '{device}' is not there ({reason}); use cpu or numpy"
        ) from None
    if like.device.type == "cuda":
        refuse_without_compiler(device)
    return like


def refuse_without_compiler(device: str) -> None:
    """Refuses a GPU for which Numba can't compile the contact.

    Raises:
        DisasmError: says what to install.
    """
    from numba import cuda

    is_too_new = NumpyVersion(np.__version__) >= "2.5.0"  # for numba-cuda
    if is_too_new or not cuda.is_available():
        raise DisasmError(
            f"device: Numba can't compile contact for '{device}'; "
            "pip install 'drake_disasm[gpu]', or use cpu or numpy"
        )


def refuse_count(count: int, scenarios: int = 1) -> None:
    """Refuses a batch of nothing, or of another size than its scenarios.

    Raises:
        DisasmError: says what to give.
    """
    if not isinstance(count, int) or min(count, scenarios) < 1:
        raise DisasmError(f"num_envs: {count} is no number of environments; give 1")
    if scenarios not in (1, count):
        raise DisasmError(
            f"scenarios: {scenarios} for {count} environments; give one for each, or "
            "one for all"
        )


def refuse_scenarios(scenarios: Sequence[Scenario]) -> None:
    """Refuses scenarios that one batch can't simulate.

    Raises:
        DisasmError: names the first field or effect, and the remedy.
    """
    for scenario in {repr(s): s for s in scenarios}.values():
        validate(scenario)
        _refuse_contact(scenario)
        refuse_unknown_kinds(scenario.effects)
        refuse_arm_effects([e for e in scenario.effects if isinstance(e, ArmEffect)])
        _refuse_late_poses(scenario)
        nominal = scenario.part.environment(scenario.contact)
        refuse_without_quantity("impact", nominal, scenario.effects)
        _refuse_sampling(scenario)
        for end in ("low", "high"):
            _refuse_others(corner(scenario, end), corner(scenarios[0], "low"))


def _refuse_others(scenario: Scenario, first: Scenario) -> None:
    """Refuses what differs and is one for a batch."""
    for name, value in _SHARED.items():
        if value(scenario) != value(first):
            raise DisasmError(
                f"{name}: {value(scenario)} and {value(first)} in one batch; make a "
                "batch for each"
            )


def _refuse_contact(scenario: Scenario) -> None:
    if scenario.contact.model != "impact":
        raise DisasmError(
            f"contact.model: '{scenario.contact.model}' has no form for a batch; set "
            "it to impact, or use the diagram's twin"
        )
    scenario.part.required_gaps()


def _refuse_late_poses(scenario: Scenario) -> None:
    for effect in scenario.effects:
        if isinstance(effect, PoseEffect):
            raise DisasmError(
                f"{type(effect).__name__}: a batch reports poses as they are; take it "
                "out, or use the diagram's twin"
            )


def _refuse_sampling(scenario: Scenario) -> None:
    """A sensor with a memory takes its samples where the plant has just stepped."""
    memories = [
        e for e in sensor_chain(scenario.effects) if isinstance(e, SensorMemoryEffect)
    ]
    fine, period = scenario.simulation.twin_time_step, scenario.ft_sensor.period
    for longer, shorter in ((period, fine), (scenario.task.period, period)):
        count = longer / shorter
        if memories and abs(count - round(count)) > 1e-6:
            raise DisasmError(
                f"ft_sensor.period: {period:g} s does not fit between the twin's step "
                f"of {fine:g} s and the task's of {scenario.task.period:g} s, as "
                f"{type(memories[0]).__name__} needs in a batch; give a whole fraction"
            )
