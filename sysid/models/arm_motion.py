"""The recorded motion of an arm, and the torques that it takes with given effects."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from drake_disasm.effects import (
    ArmEffect,
    ArmSamples,
    ArmTilt,
    ArmTorqueEffect,
    DelayEffect,
    EncoderError,
    FlangePayload,
    JointElasticity,
    JointMemoryEffect,
    LinkPayload,
)
from drake_disasm.logs import Episode
from sysid.models.base import Array
from sysid.models.link_torques import LinkTorques
from sysid.models.path_memory import PathMemory
from sysid.models.regressor import ArmRegressor, BaseSet

#: Effects that show in the torques of a motion: what `ArmMotion` knows.
IN_TORQUES = (
    ArmTorqueEffect,
    DelayEffect,
    FlangePayload,
    LinkPayload,
    ArmTilt,
    JointElasticity,
    JointMemoryEffect,
    EncoderError,
)

_ADDED = (ArmTorqueEffect, JointMemoryEffect)
_BY_SAMPLE = (
    "row",
    "time",
    "episode",
    "q",
    "v",
    "vd",
    "dry_v",
    "Y",
    "Y_payload",
    "Y_tilt",
    "tilt",
)


@dataclasses.dataclass(frozen=True)
class ArmMotion:
    """Samples of an arm's motion, with what its torques are linear in.

    Attributes:
        joints: their names.
        row: (n,) number of each sample among all those of the log.
        time: (n,) [s].
        episode: (n,) number of each sample's episode.
        q, v, vd: (n, joints).
        dry_v: (n, joints) velocity as dry friction sees it: v, or at rest that with
            which the joint came.
        Y: (n, joints, b) regressor of the base parameters.
        Y_payload: (n, joints, 10) of a body in the frame of the last link.
        Y_tilt: (n, joints, b, 2) derivative of Y by a tilt [rx, ry] of the base.
        tilt: (n, joints, 2) the same of the torques by the nominal parameters.
        nominal: (b,) base parameters by the URDF.
        links: (joints, b, 10) what a body on each joint's link adds to them.
        linked: of all samples of the log.
        paths: of all samples of the log.
    """

    joints: tuple[str, ...]
    row: NDArray[np.int64]
    time: Array
    episode: NDArray[np.int64]
    q: Array
    v: Array
    vd: Array
    dry_v: Array
    Y: Array
    Y_payload: Array
    Y_tilt: Array
    tilt: Array
    nominal: Array
    links: Array
    linked: LinkTorques
    paths: PathMemory

    @classmethod
    def of(
        cls,
        arm: ArmRegressor,
        base: BaseSet,
        joints: Sequence[str],
        episodes: Sequence[Episode | Mapping[str, Array]],
    ) -> Self:
        """Returns all samples of episodes, in their order.

        Args:
            arm: that moves.
            base: its base parameters.
            joints: their names.
            episodes: each with time, q, v and vd.
        """
        q, v, vd, time = (
            np.concatenate([e[name] for e in episodes])
            for name in ("q", "v", "vd", "time")
        )
        Y, Y_tilt = arm.with_tilt(q, v, vd)
        counts = [len(e["time"]) for e in episodes]
        episode = np.repeat(np.arange(len(episodes)), counts)
        return cls(
            tuple(joints),
            np.arange(len(time)),
            time,
            episode,
            q,
            v,
            vd,
            v,
            Y[:, :, base.independent],
            Y[:, :, arm.last_link],
            Y_tilt[:, :, base.independent],
            np.einsum("njkt,k->njt", Y_tilt, arm.inertia),
            base.beta(arm.inertia),
            np.moveaxis(base.matrix(len(arm.inertia))[:, arm.moved_links], 1, 0),
            LinkTorques(
                arm.urdf,
                joints,
                time,
                episode,
                np.stack([q, v, vd]),
                arm.gravity,
                arm.given_inertia,
            ),
            PathMemory(joints, episode, q),
        )

    def rows(self, chosen: slice | NDArray[np.bool_]) -> Self:
        """Returns some of the samples."""
        return dataclasses.replace(
            self, **{name: getattr(self, name)[chosen] for name in _BY_SAMPLE}
        )

    def torques(
        self,
        beta: Array,
        effects: Sequence[ArmEffect],
        filtered: Callable[[Array, Sequence[ArmEffect]], Array] | None = None,
    ) -> Array:
        """Returns the joints' torques (n, joints), all but shifts in time.

        Args:
            beta: (b,) base parameters.
            effects: on the arm.
            filtered: gives the torques of effects that `has_edges` under a load
                (n, joints), as the log's filter left them; None for no filter.
        """
        samples = self.samples(beta, effects)
        torque, edged = samples.load, []
        for effect in effects:
            if filtered is not None and has_edges(effect):
                edged.append(effect)
            elif isinstance(effect, _ADDED) and not effect.is_null:
                v = self.dry_v if effect.is_dry else self.v
                seen = dataclasses.replace(samples, v=v)
                torque = torque + torque_of(effect, seen, self.paths, self.row)
        return torque if filtered is None else torque + filtered(samples.load, edged)

    def samples(self, beta: Array, effects: Sequence[ArmEffect]) -> ArmSamples:
        """Returns the motion with the load that the rigid bodies are.

        Args:
            beta: (b,) base parameters.
            effects: on the arm; bodies that it carries, a tilt, gears that yield and
                encoders that are wrong are in the load.
        """
        load: Array = self.Y @ beta
        for effect in effects:
            if isinstance(effect, FlangePayload):
                load = load + self.Y_payload @ effect.inertial
            elif isinstance(effect, LinkPayload):
                at = self.joints.index(effect.joint)
                load = load + self.Y @ (self.links[at] @ effect.inertial)
            elif isinstance(effect, ArmTilt) and not effect.is_null:
                by_base = np.einsum("njbt,b->njt", self.Y_tilt, beta - self.nominal)
                load = load + (self.tilt + by_base) @ [effect.rx, effect.ry]
            elif isinstance(effect, JointElasticity) and not effect.is_null:
                by_compliance = self.linked.by_compliance(effect.joint, self.row)
                load = load + effect.compliance * by_compliance
            elif isinstance(effect, EncoderError):
                load = load + self._by_encoder(effect)
        return ArmSamples(self.joints, self.q, self.v, self.vd, load)

    def _by_encoder(self, effect: EncoderError) -> Array | float:
        """Returns what an encoder's error changes of the load (n, joints)."""
        linked, row, joint = self.linked, self.row, effect.joint
        changed: Array | float = 0.0
        if effect.offset:
            changed = changed + effect.offset * linked.by_offset(joint, row)
        if effect.scale:
            changed = changed + effect.scale * linked.by_scale(joint, row)
        return changed

    def shifted(self, torque: Array, effects: Sequence[DelayEffect]) -> Array:
        """Returns torques (n, joints) as they are read, late or early.

        Between samples they are interpolated by cubic splines; before the first and
        after the last of an episode, they stay as they are there.
        """
        read = torque.copy()
        for i, joint in enumerate(self.joints):
            late = sum(e.delay for e in effects if e.delays(joint))
            for number in np.unique(self.episode) if late else ():
                own = self.episode == number
                t = self.time[own]
                at = np.clip(t - late, t[0], t[-1])
                read[own, i] = CubicSpline(t, torque[own, i])(at)
        return read


def torque_of(
    effect: ArmEffect,
    samples: ArmSamples,
    paths: PathMemory,
    row: slice | NDArray[np.int64],
) -> Array:
    """Returns what an effect adds to the load of samples (n, joints).

    Args:
        effect: with torques of its own.
        samples: of the motion.
        paths: of the whole motion.
        row: of the samples in that.
    """
    if isinstance(effect, ArmTorqueEffect):
        return effect.torques(samples)
    added = np.zeros_like(samples.load)
    if isinstance(effect, JointMemoryEffect):
        memory = paths.of(effect)[row]
        added[:, samples.joints.index(effect.joint)] = effect.torque(memory)
    return added


def has_edges(effect: ArmEffect) -> bool:
    """Returns whether an effect adds torques that a filter of the motion leaves as is.

    False of one that is null, or acts through the load.
    """
    if isinstance(effect, ArmTorqueEffect):
        return not (effect.is_null or effect.is_filtered)
    return isinstance(effect, JointMemoryEffect) and not effect.is_null
