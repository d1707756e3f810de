"""A log model of your own: a motor-driven pendulum that lacks an effect.

    python examples/own_log_model.py

`identify(model)` fits a model, and `close_loop(model)` finds which effect it lacks.
"""

import numpy as np
from scipy.integrate import solve_ivp

from drake_disasm.effects import JointCoulombFriction, JointEffect, JointSamples
from sysid.effect_selection import close_loop
from sysid.identification import identify
from sysid.models import Channel, LogModel, Measurements
from sysid.parameters import Parameter

# The true pendulum; the model below has no friction.
INERTIA, WEIGHT, FRICTION = 0.05, 1.2, JointCoulombFriction("pivot", size=0.15)


def motor_torque(t):
    return 1.1 * np.sin(2.0 * t) + 0.6 * np.sin(5.3 * t)


def acceleration(t, q, v):
    friction = FRICTION.torque(JointSamples(q, v, vd=0 * v, load=0 * v))
    return (motor_torque(t) - WEIGHT * np.sin(q) - friction) / INERTIA


class Pendulum(LogModel):
    """tau = J vd + w sin q, plus the torque of effects at the joint "pivot"."""

    affine = True  # in J, w and the amplitudes of effects
    effect_types = (JointEffect,)  # those that `predict` can apply

    def __init__(self, motion, torque):
        self.motion = motion  # (rows, 3) position, velocity and acceleration
        self.parameters = (
            Parameter("J", 0.02, 0.0, 1.0, "kg m^2"),
            Parameter("w", 1.0, 0.0, 5.0, "N m"),
        )
        self.measurements = Measurements.of_array(torque, [Channel("pivot", "N m")])

    def predict(self, theta, rows):
        q, v, vd = self.motion[rows].T
        rigid = theta[0] * vd + theta[1] * np.sin(q)
        samples = JointSamples(q, v, vd, load=rigid)
        return rigid + sum(e.torque(samples) for e in self.effects_at(theta))

    def select_rows(self, mask):
        return self.replace(motion=self.motion[mask])


t = np.arange(0.0, 20.0, 0.01)
swing = solve_ivp(lambda t, x: [x[1], acceleration(t, *x)], (0, 20), [0, 0], t_eval=t)
motion = np.column_stack([*swing.y, acceleration(t, *swing.y)])
torque = motor_torque(t) + np.random.default_rng(0).normal(0.0, 0.02, t.size)
model = Pendulum(motion, torque)
print("fitted:", identify(model).values, close_loop(model).text, sep="\n")
