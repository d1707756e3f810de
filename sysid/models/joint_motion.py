"""An arm's joint torques from its motion: rigid bodies, of any URDF."""

import dataclasses
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import ArmEffect, ArmResidualModel, DelayEffect, Effect
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.scenario import Scenario
from sysid.models.arm_logs import arm_urdf, refuse_other_joints, refuse_other_logs
from sysid.models.arm_motion import IN_TORQUES, ArmMotion
from sysid.models.base import Array, LogModel
from sysid.models.effects import one_way_joints, travel_of
from sysid.models.joint_units import in_units_of_joints
from sysid.models.measurements import Channel, Measurements
from sysid.models.regressor import ArmDynamics, BaseSet, base_set
from sysid.parameters import Parameter

_NEEDED = ("q", "v", "vd", "tau")
_REACH = 5.0  # times the value with which a parameter alone gives all the torque


class JointMotionModel(LogModel):
    """tau = Y(q, v, vd) beta, with beta the identifiable base parameters.

    Of ten inertial parameters per link, many have no effect on joint torques, and
    others only in linear combinations. `parameters` are those combinations; each is
    named by its first term, and `doc` has them all. Parameters of arm effects come
    after the base parameters.
    """

    affine = True
    effect_types = IN_TORQUES
    residual_effect = ArmResidualModel

    def __init__(
        self,
        logs: Sequence[Log],
        urdf: str | None = None,
        scenario: Scenario | None = None,
    ) -> None:
        """Reads the motion from the logs.

        Args:
            logs: of joint motion, with q, v, vd and tau, of one arm.
            urdf: of the arm; by default the one named in the first log.
            scenario: whose arm effects act.

        Raises:
            DisasmError: a log is of another kind or arm, lacks a quantity, there is
                no URDF, or an effect acts at a joint that the log does not have.
        """
        episodes = [e for log in logs for e in log.episodes]
        refuse_other_logs(logs, "joint_motion", "inverse dynamics")
        _refuse_missing(episodes)
        header = logs[0].header
        arm = ArmDynamics(arm_urdf(logs, urdf), header.joints)
        base = base_set(arm.random_regressor())
        self._scenario = scenario or Scenario()
        self._effects = tuple(self._scenario.effects)
        refuse_other_joints(self._effects, header.joints)
        # Shifts in time need neighbours of rows that are not fitted themselves.
        self._whole = ArmMotion.of(arm, base, header.joints, episodes)
        self._motion = self._whole
        self._taken = np.ones(len(self._whole.time), dtype=bool)
        self._prismatic = arm.prismatic
        channels = tuple(
            Channel(j, "N" if j in self._prismatic else "N m", np.nan, "estimated")
            for j in header.joints
        )
        self.measurements = Measurements.of_logs(
            logs, channels, lambda _, episode: episode["tau"]
        )
        self.parameters = self._base_parameters(arm, base)

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        beta, on_arm = theta[: len(self._motion.nominal)], self._on_arm(theta)
        shifts = [e for e in on_arm if isinstance(e, DelayEffect) and not e.is_null]
        if not shifts:
            return self._motion.rows(rows).torques(beta, on_arm)
        torque = self._whole.torques(beta, on_arm)
        return self._whole.shifted(torque, shifts)[self._taken][rows]

    def _on_arm(self, theta: Array) -> list[ArmEffect]:
        return [e for e in self.effects_at(theta) if isinstance(e, ArmEffect)]

    def with_effects(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter] = ()
    ) -> Self:
        """See LogModel; additional parameters get the units of their joints."""
        added = in_units_of_joints(parameters, effects, self._prismatic)
        return super().with_effects(effects, added)

    def scenario_at(self, theta: Array) -> Scenario:
        """Returns a scenario with the effects; base parameters are no part of it."""
        effects: list[Any] = list(self.effects_at(theta))
        return dataclasses.replace(self._scenario, effects=effects, randomisation=[])

    def residual_inputs(self, theta: Array) -> dict[str, Array]:
        """See LogModel; of shifts in time, which are short, they know nothing."""
        theta = self.with_frozen(theta)
        samples = self._motion.samples(
            theta[: len(self._motion.nominal)], self._on_arm(theta)
        )
        inputs_of = ArmResidualModel.inputs_of
        return {joint: inputs_of(samples, joint) for joint in samples.joints}

    @property
    def travel(self) -> dict[str, float]:
        """See LogModel."""
        return travel_of(self.joints, self._motion.q)

    @property
    def one_way(self) -> tuple[str, ...]:
        """See LogModel."""
        return one_way_joints(self.joints, self._motion.v)

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel: the joint's own motion."""
        names = {"q": "position", "v": "velocity", "vd": "acceleration"}
        return {w: getattr(self._motion, k)[:, channel] for k, w in names.items()}

    def only(self, names: Sequence[str]) -> Self:
        """Returns the same model with all but the named parameters frozen.

        They keep the URDF's values.

        Raises:
            DisasmError: there is no such base parameter.
        """
        base = [p for p in self.parameters if not p.path]
        known = [p.name for p in base]
        for name in names:
            if name not in known:
                raise DisasmError(
                    f"parameter {name}: not a base parameter of this arm; "
                    f"{closest(name, known)}"
                )
        rest = {p.name: p.nominal for p in base if p.name not in names}
        return self.freeze(rest)

    def _base_parameters(
        self, arm: ArmDynamics, base: BaseSet
    ) -> tuple[Parameter, ...]:
        """Returns base parameters with bounds wide enough for any real arm."""
        size = np.sqrt(np.mean(self._motion.Y**2, axis=(0, 1)))
        # Of a log of zeros any bounds will do: checks of the data refuse it by name.
        torque = float(np.sqrt(np.mean(self.measurements.values**2))) or 1.0
        reach = np.abs(self._motion.nominal) + _REACH * torque / np.maximum(size, 1e-9)
        return tuple(
            Parameter(
                arm.names[base.independent[i]],
                float(value),
                float(value - reach[i]),
                float(value + reach[i]),
                arm.units[base.independent[i]],
                base.label(i, arm.names),
            )
            for i, value in enumerate(self._motion.nominal)
        )

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """See LogModel."""
        taken = self._taken.copy()
        taken[taken] = mask
        return self.replace(_motion=self._motion.rows(mask), _taken=taken)


def _refuse_missing(episodes: Sequence[Episode]) -> None:
    for episode in episodes:
        for quantity in _NEEDED:
            if quantity not in episode:
                raise refusal(
                    episode.path,
                    f"no columns '{quantity}.*'",
                    "inverse dynamics needs q, v, vd and tau; map q and tau in "
                    "import-log, which makes v and vd",
                )
