"""The sensor's channels are coupled."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import Array, apply_matrix, last_axis, namespace
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorCrossTalk(SensorEffect):
    """A channel responds to the loads of other channels.

    Equation: F_read = (1 + C) F with C a 6x6 matrix in S, zero on its diagonal (that
    is SensorGain); `fx_ty` is its element in the row of fx and the column of ty.
    Where it acts: the force/torque sensor's calibration; zeroing sees it.
    """

    fx_fy: float = amplitude("1", -0.5, 0.5, "what fx picks up of fy")
    fx_fz: float = amplitude("1", -0.5, 0.5, "what fx picks up of fz")
    fx_tx: float = amplitude("1/m", -10.0, 10.0, "what fx picks up of tx")
    fx_ty: float = amplitude("1/m", -10.0, 10.0, "what fx picks up of ty")
    fx_tz: float = amplitude("1/m", -10.0, 10.0, "what fx picks up of tz")
    fy_fx: float = amplitude("1", -0.5, 0.5, "what fy picks up of fx")
    fy_fz: float = amplitude("1", -0.5, 0.5, "what fy picks up of fz")
    fy_tx: float = amplitude("1/m", -10.0, 10.0, "what fy picks up of tx")
    fy_ty: float = amplitude("1/m", -10.0, 10.0, "what fy picks up of ty")
    fy_tz: float = amplitude("1/m", -10.0, 10.0, "what fy picks up of tz")
    fz_fx: float = amplitude("1", -0.5, 0.5, "what fz picks up of fx")
    fz_fy: float = amplitude("1", -0.5, 0.5, "what fz picks up of fy")
    fz_tx: float = amplitude("1/m", -10.0, 10.0, "what fz picks up of tx")
    fz_ty: float = amplitude("1/m", -10.0, 10.0, "what fz picks up of ty")
    fz_tz: float = amplitude("1/m", -10.0, 10.0, "what fz picks up of tz")
    tx_fx: float = amplitude("m", -0.1, 0.1, "what tx picks up of fx")
    tx_fy: float = amplitude("m", -0.1, 0.1, "what tx picks up of fy")
    tx_fz: float = amplitude("m", -0.1, 0.1, "what tx picks up of fz")
    tx_ty: float = amplitude("1", -0.5, 0.5, "what tx picks up of ty")
    tx_tz: float = amplitude("1", -0.5, 0.5, "what tx picks up of tz")
    ty_fx: float = amplitude("m", -0.1, 0.1, "what ty picks up of fx")
    ty_fy: float = amplitude("m", -0.1, 0.1, "what ty picks up of fy")
    ty_fz: float = amplitude("m", -0.1, 0.1, "what ty picks up of fz")
    ty_tx: float = amplitude("1", -0.5, 0.5, "what ty picks up of tx")
    ty_tz: float = amplitude("1", -0.5, 0.5, "what ty picks up of tz")
    tz_fx: float = amplitude("m", -0.1, 0.1, "what tz picks up of fx")
    tz_fy: float = amplitude("m", -0.1, 0.1, "what tz picks up of fy")
    tz_fz: float = amplitude("m", -0.1, 0.1, "what tz picks up of fz")
    tz_tx: float = amplitude("1", -0.5, 0.5, "what tz picks up of tx")
    tz_ty: float = amplitude("1", -0.5, 0.5, "what tz picks up of ty")

    stage = 2
    noun = "cross-talk of the sensor"
    experiment = "a known weight along one axis of the sensor at a time"
    task_experiment = "presses along one axis of the groove at a time"
    experiments_against: ClassVar = {
        "SensorMounting": (
            "a known weight along one axis at a time: rotated axes mix channels "
            "antisymmetrically"
        ),
    }

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Mixes the channels."""
        shares = iter([getattr(self, field.name) for field in dataclasses.fields(self)])
        rows = [
            last_axis([0.0 if i == j else next(shares) for j in range(6)], wrench_S)
            for i in range(6)
        ]
        C = namespace(wrench_S).stack(rows, axis=-2)
        return wrench_S + apply_matrix(C, wrench_S)
