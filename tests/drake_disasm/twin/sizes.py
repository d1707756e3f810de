"""A noticeable size of each effect on the twin, and an episode in which it shows."""

import numpy as np

from drake_disasm import effects as ef

EFFECTS: list[ef.Effect] = [
    ef.GroovePose(rx=0.01, ry=0.02, rz=0.005, x=-0.001, y=2e-4, z=5e-4),
    ef.GrooveBend(ky=-0.1, kz=0.3),
    ef.GrooveClearance(change=-2e-4),
    ef.GrooveFriction(coefficient=0.2),
    ef.GrooveViscousFriction(coefficient=60.0),
    ef.GrooveStribeckFriction(coefficient=0.3, velocity=0.02),
    ef.RustyPatch(coefficient=0.5, position=0.02),
    ef.ContactStiffness(log_factor=-4.0),
    ef.ContactExponent(change=2.5),
    ef.ChainPull(fx=-1.0, fy=0.5, fz=1.0, k=20.0),
    ef.CommandGain(x=-0.05, z=0.1, v=0.2),
    ef.MotionLag(delay=0.06),
    ef.Backlash(x=4e-4, z=3e-4, v=0.004),
    ef.Compliance(x=2e-5, z=4e-5, v=1e-3),
    ef.BoltSlip(x=1e-4, z=2e-4),
    ef.SensorBias(fx=0.5, fz=-1.0, ty=0.02),
    ef.SensorDrift(fx=0.3, ty=0.02, duration=1.5),
    ef.SensorWarmUp(fz=1.0, tx=0.05, time_constant=1.0),
    ef.SensorStep(fx=1.0, tz=0.03, onset=1.03, rise=0.2),
    ef.SensorGain(fx=0.2, fz=-0.1, ty=0.1),
    ef.SensorGainDrift(fx=0.1, fz=0.05),
    ef.SensorCrossTalk(fx_fz=0.1, fz_tx=2.0, tx_fy=0.02, ty_tz=0.2),
    ef.SensorLag(share=1.0, time_constant=0.15),
    ef.SensorDelay(share=0.9, delay=0.13),
    ef.SensorHysteresis(share=0.7, width=0.5),
    ef.SensorSaturation(share=1.0, limit=1.5),
    ef.SensorDeadBand(force=1.0, torque=1.0, width=0.4, beyond=0.5),
    ef.SensorMounting(rx=0.05, ry=0.1, rz=-0.04),
    ef.PayloadError(mass=1.0, cx=0.05, cz=0.1),
    ef.BaseTilt(rx=0.2, ry=-0.15),
    ef.Imprecision(x=1e-4, z=1e-4),
]


def actions(steps: int, turn: float = 4e-3) -> np.ndarray:
    """Returns an episode's actions (steps, 6): along the turned groove, and about.

    They press the bolt against one wall with some newtons, then against the other, and
    against floor and lips.

    Args:
        steps: how many.
        turn: largest rotation of a step [rad].
    """
    random = np.random.default_rng(0)
    found = random.uniform(-1, 1, (steps, 6)) * [8e-4, 1e-4, 2e-4, turn, turn, turn]
    found[:, 0] += 2.2e-3
    found[:, 2] -= 0.035 * found[:, 0]
    found[2:4, 2] += 2.5e-3
    found[12:16, 2] -= 2.5e-3
    found[5:6, 1] += 1.5e-3
    found[18:20, 1] -= 1.5e-3
    return found
