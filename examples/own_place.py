"""A log model whose joints are not its channels, and an effect in a place of its own.

python examples/own_place.py

A finger has two joints and one motor, which pulls a tendon over a pulley at each joint.
The log has one channel, the tendon's force. Friction may act at either joint, and in
the tendon's sheath, which is a place that no arm has.
"""

import abc
import dataclasses

import numpy as np

from drake_disasm.effects import (
    Effect,
    JointEffect,
    JointSamples,
    amplitude,
    register_effect,
)
from sysid.effect_selection import close_loop
from sysid.models import Channel, LogModel, Measurements
from sysid.parameters import Parameter

RADIUS = np.array([0.012, 0.008])  # m, of the joints' pulleys


class TendonEffect(Effect, abc.ABC):
    """Acts on the tendon: the place that this model adds."""

    @abc.abstractmethod
    def force(self, rate: np.ndarray) -> np.ndarray:
        """Returns what it adds to the tendon's force (n,) [N], of its rate [m/s]."""


@register_effect(place=TendonEffect)
@dataclasses.dataclass
class SheathFriction(TendonEffect):
    """Dry friction between tendon and sheath.

    Equation: f = c tanh(v / 1 mm/s), v the rate of the tendon.
    Where it acts: the tendon.
    """

    size: float = amplitude("N", 0.0, 50.0, "c, the friction's force")

    def force(self, rate):
        """Returns the friction."""
        return self.size * np.tanh(rate / 1e-3)


class Finger(LogModel):
    """f = sum of (J vdot + k q) / r over the joints, plus the force of effects."""

    affine = True
    effect_types = (JointEffect, TendonEffect)
    joints = ("knuckle", "tip")  # where effects at a joint may act; one channel

    def __init__(self, q, v, vd, force):
        self.q, self.v, self.vd = q, v, vd  # (rows, 2) [rad, rad/s, rad/s^2]
        self.parameters = tuple(
            Parameter(f"{name}_{joint}", start, 0.0, 10.0 * start, unit)
            for joint in self.joints
            for name, start, unit in (("J", 1e-4, "kg m^2"), ("k", 0.05, "N m/rad"))
        )
        self.measurements = Measurements.of_array(force, [Channel("tendon", "N")])

    def predict(self, theta, rows):
        q, v, vd = self.q[rows], self.v[rows], self.vd[rows]
        torque = theta[[0, 2]] * vd + theta[[1, 3]] * q
        force = np.zeros(len(q))
        for effect in self.effects_at(theta):
            if isinstance(effect, TendonEffect):
                force += effect.force(v @ RADIUS)
            else:
                i = self.joints.index(effect.joint)
                torque[:, i] += effect.torque(
                    JointSamples(q[:, i], v[:, i], vd[:, i], torque[:, i])
                )
        return force + (torque / RADIUS).sum(axis=1)

    def select_rows(self, mask):
        return self.replace(q=self.q[mask], v=self.v[mask], vd=self.vd[mask])


if __name__ == "__main__":
    t = np.arange(0.0, 30.0, 0.01)[:, None]
    w = np.array([[1.3, 2.1], [3.7, 2.9]])  # rad/s: two sines at each joint
    q, v = np.sin(w[0] * t) + 0.3 * np.sin(w[1] * t), w[0] * np.cos(w[0] * t)
    v += 0.3 * w[1] * np.cos(w[1] * t)
    vd = -(w[0] ** 2) * np.sin(w[0] * t) - 0.3 * w[1] ** 2 * np.sin(w[1] * t)
    force = ((2e-4 * vd + 0.08 * q) / RADIUS).sum(axis=1)
    force += SheathFriction(3.0).force(v @ RADIUS)
    force += np.random.default_rng(0).normal(0.0, 0.3, len(t))
    print(close_loop(Finger(q, v, vd, force)).text)
