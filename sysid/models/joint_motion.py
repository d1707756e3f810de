"""An arm's joint torques from its motion: rigid bodies, of any URDF."""

from collections.abc import Mapping, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import FlangePayload, JointEffect, JointSamples
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.scenario import Scenario, with_values
from sysid.models.base import Array, Channel, Measurements, ScenarioModel
from sysid.models.regressor import ArmDynamics, BaseSet, base_set
from sysid.parameters import Parameter, by_name, by_path

_NEEDED = ("q", "v", "vd", "tau")
_REACH = 5.0  # times what a parameter would need to explain all torque alone


class JointMotionModel(ScenarioModel):
    """tau = Y(q, v, vd) beta, with beta the identifiable base parameters.

    Of ten inertial parameters per link, many never show in joint torques, and
    others only in sums. `parameters` are the sums that do show; each is named by
    the first of its terms, and `doc` has them all. Of a scenario, its arm effects
    act, and their parameters come after the base parameters.
    """

    def __init__(
        self,
        logs: Sequence[Log],
        urdf: str | None = None,
        scenario: Scenario | None = None,
    ) -> None:
        """Takes the motion out of the logs.

        Args:
            logs: of joint motion, with q, v, vd and tau, of one arm.
            urdf: the arm; by default what the first log names.
            scenario: whose arm effects act.

        Raises:
            DisasmError: a log is of another kind or arm, lacks a quantity, there is
                no URDF, or an effect acts at a joint that the log does not have.
        """
        episodes = [(log, e) for log in logs for e in log.episodes]
        _refuse_other_logs(logs, episodes)
        header = logs[0].header
        urdf = urdf or header.urdf
        if urdf is None:
            raise refusal(
                logs[0].folder / "log.yaml", "no 'urdf'", "name the arm by --urdf FILE"
            )
        arm = ArmDynamics(urdf, header.joints)
        base = base_set(arm.random_regressor())
        parts = [arm.regressor(e["q"], e["v"], e["vd"]) for _, e in episodes]
        self.scenario = scenario or Scenario()
        _refuse_other_joints(self.scenario, header.joints)
        self._motion = {
            name: np.concatenate([e[name] for _, e in episodes])
            for name in ("q", "v", "vd")
        }
        Y = np.concatenate(parts)
        self._Y, self._Y_F = Y[:, :, base.independent], Y[:, :, arm.last_link]
        self._beta = base.beta(arm.inertia)
        self._fixed = np.zeros(len(self._beta))
        self._free = np.arange(len(self._beta))
        self.affine = True
        channels = tuple(Channel(j, "N m", np.nan, "estimated") for j in header.joints)
        self.measurements = Measurements.of_logs(
            logs, channels, lambda _, episode: episode["tau"]
        )
        self.parameters = self._base_parameters(arm, base)

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        beta, count = self._fixed.copy(), len(self._free)
        beta[self._free] = theta[:count]
        load: Array = self._Y[rows] @ beta
        effects = self.scenario_at(theta).effects
        for effect in effects:
            if isinstance(effect, FlangePayload):
                load = load + self._Y_F[rows] @ effect.inertial
        torque = load.copy()
        joints = [channel.name for channel in self.measurements.channels]
        for effect in effects:
            if isinstance(effect, JointEffect):
                i = joints.index(effect.joint)
                motion = {name: all_[rows, i] for name, all_ in self._motion.items()}
                samples = JointSamples(**motion, load=load[:, i])
                torque[:, i] += effect.torque(samples)
        return torque

    def scenario_at(self, theta: Array) -> Scenario:
        """See ScenarioModel; base parameters are no part of a scenario."""
        count = len(self._free)
        own = self.parameters[count:]
        return with_values(self.scenario, by_path(own, by_name(own, theta[count:])))

    def freeze(self, values: Mapping[str, float]) -> Self:
        """See LogModel."""
        base = self.parameters[: len(self._free)]
        fixed, free = self._fixed.copy(), []
        for number, parameter in zip(self._free, base, strict=True):
            if parameter.name in values:
                fixed[number] = values[parameter.name]
            else:
                free.append(number)
        own = self.parameters[len(base) :]
        return self._changed(
            _fixed=fixed,
            _free=np.array(free, dtype=np.int64),
            scenario=with_values(self.scenario, by_path(own, values)),
            parameters=tuple(p for p in self.parameters if p.name not in values),
        )

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel: the joint's own motion."""
        names = {"q": "position", "v": "velocity", "vd": "acceleration"}
        return {word: self._motion[key][:, channel] for key, word in names.items()}

    def only(self, names: Sequence[str]) -> Self:
        """Returns the same model with all but the named parameters at the URDF's.

        Raises:
            DisasmError: there is no such base parameter.
        """
        base = self.parameters[: len(self._free)]
        known = [p.name for p in base]
        for name in names:
            if name not in known:
                raise DisasmError(
                    f"parameter {name}: is no base parameter of this arm; "
                    f"{closest(name, known)}"
                )
        rest = {p.name: p.nominal for p in base if p.name not in names}
        return self.freeze(rest)

    def urdf_values(self) -> Mapping[str, float]:
        """Returns the base parameters that the URDF's inertias amount to, by name."""
        base = self.parameters[: len(self._free)]
        return by_name(base, self._beta[self._free])

    def _base_parameters(
        self, arm: ArmDynamics, base: BaseSet
    ) -> tuple[Parameter, ...]:
        """Returns base parameters with bounds wide enough for any real arm."""
        size = np.sqrt(np.mean(self._Y**2, axis=(0, 1)))
        torque = float(np.sqrt(np.mean(self.measurements.values**2)))
        reach = np.abs(self._beta) + _REACH * torque / np.maximum(size, 1e-9)
        return tuple(
            Parameter(
                arm.names[base.independent[i]],
                float(value),
                float(value - reach[i]),
                float(value + reach[i]),
                arm.units[base.independent[i]],
                base.label(i, arm.names),
            )
            for i, value in enumerate(self._beta)
        )

    def _selected(self, mask: NDArray[np.bool_]) -> Self:
        return self._changed(
            _Y=self._Y[mask],
            _Y_F=self._Y_F[mask],
            _motion={name: values[mask] for name, values in self._motion.items()},
            measurements=self.measurements.select(mask),
        )


def _refuse_other_joints(scenario: Scenario, joints: Sequence[str]) -> None:
    for number, effect in enumerate(scenario.effects):
        if isinstance(effect, JointEffect) and effect.joint not in joints:
            raise DisasmError(
                f"effects.{number}.joint: the log has no joint '{effect.joint}'; "
                f"{closest(effect.joint, list(joints))}"
            )


def _refuse_other_logs(
    logs: Sequence[Log], episodes: Sequence[tuple[Log, Episode]]
) -> None:
    for log in logs:
        where, header = log.folder / "log.yaml", log.header
        if header.kind != "joint_motion":
            raise refusal(
                where,
                f"a log of kind '{header.kind}', inverse dynamics needs 'joint_motion'",
                "name such a log",
            )
        if header.joints != logs[0].header.joints:
            raise refusal(where, "other joints than in the first log", "fit it apart")
    for _, episode in episodes:
        for quantity in _NEEDED:
            if quantity not in episode:
                raise refusal(
                    episode.path,
                    f"no columns '{quantity}.*'",
                    "inverse dynamics needs q, v, vd and tau; differentiate and "
                    "filter q",
                )
