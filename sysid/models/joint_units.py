"""Units of what acts at a joint: those of a prismatic joint are not a rotary one's."""

import dataclasses
from collections.abc import Collection, Sequence

from drake_disasm.effects import Effect
from sysid.parameters import Parameter

#: What stands in a unit of a rotary joint, and in that of a prismatic one instead.
_PRISMATIC = (("kg m^2", "kg"), ("(N m)", "N"), ("N m", "N"), ("rad", "m"))


def prismatic_unit(unit: str) -> str:
    """Returns the unit at a prismatic joint of what has one at a rotary joint.

    As N s/m of N m s/rad.
    """
    for rotary, prismatic in _PRISMATIC:
        unit = unit.replace(rotary, prismatic)
    return unit


def in_units_of_joints(
    parameters: Sequence[Parameter],
    effects: Sequence[Effect],
    prismatic: Collection[str],
) -> list[Parameter]:
    """Returns fields of effects, each in the unit of the joint where its effect acts.

    Args:
        parameters: whose paths are `effects.0.size` and the like, in units of a rotary
            joint.
        effects: of the model.
        prismatic: names of the prismatic joints.
    """
    found = []
    for parameter in parameters:
        effect = effects[int(parameter.path.split(".")[1])]
        if getattr(effect, "joint", "") in prismatic:
            unit = prismatic_unit(parameter.unit)
            parameter = dataclasses.replace(parameter, unit=unit)
        found.append(parameter)
    return found
