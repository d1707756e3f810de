"""An arm's joint torques from its motion: rigid bodies, of any URDF."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import UniformGravityFieldElement

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import (
    ArmDelay,
    ArmEffect,
    ArmResidualModel,
    ArmTilt,
    DelayEffect,
    Effect,
    LinkPayload,
)
from drake_disasm.effects.arm.payload import PayloadEffect
from drake_disasm.logs import Episode, Log
from drake_disasm.logs.refusal import refusal
from drake_disasm.scenario import Scenario
from sysid.models.arm_logs import arm_urdf, refuse_other_joints, refuse_other_logs
from sysid.models.arm_motion import IN_TORQUES, ArmMotion, has_edges
from sysid.models.base import Array, LogModel
from sysid.models.bookkeeping import Bookkeeping
from sysid.models.channel_grams import angle_between, likely
from sysid.models.effects import one_way_joints, travel_of
from sysid.models.joint_units import in_units_of_joints
from sysid.models.log_filters import FilteredTorques, log_filters
from sysid.models.measurements import Channel, Measurements
from sysid.models.motion_bookkeeping import TorqueFits
from sysid.models.one_joint import assumption_of, is_one_joint, likely_inertia
from sysid.models.rate_factors import (
    MOST_TURN,
    median_reach,
    rate_text,
    right_rates,
)
from sysid.models.regressor import ArmRegressor, BaseSet, base_set
from sysid.models.signed_order import SignedOrder
from sysid.parameters import Parameter

#: Columns of an episode, such as time and q.
Motion = Episode | Mapping[str, Array]
_NEEDED = ("q", "v", "vd", "tau")
_REACH = 5.0  # times the value with which a parameter alone gives all the torque


class JointMotionModel(LogModel):
    """tau = Y(q, v, vd) beta, with beta the identifiable base parameters.

    Of ten inertial parameters per link, many have no effect on joint torques, and
    others only in linear combinations. `parameters` are those combinations; each is
    named by its first term, and `doc` has them all. Parameters of arm effects come
    after the base parameters. Where a log's provenance states a low-pass filter,
    effects' torques pass through it that are not linear in the motion, see
    FilteredTorques.

    Attributes:
        kind: of the logs.
        of_base: what is said of a name that is no base parameter's.
    """

    affine = True
    kind: ClassVar[str] = "joint_motion"
    of_base: ClassVar[str] = "not a base parameter of this arm"
    effect_types = IN_TORQUES
    residual_effect: ClassVar[type[Effect] | None] = ArmResidualModel
    _knows_links = False

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
        refuse_other_logs(logs, self.kind, "inverse dynamics")
        episodes = self._motions(logs)
        header = logs[0].header
        self._urdf = arm_urdf(logs, urdf)
        x, y, z = UniformGravityFieldElement().gravity_vector().tolist()
        self._gravity = (x, y, z)
        arm = ArmRegressor(self._urdf, header.joints)
        base = self._base_set(arm)
        self._inertia = None
        if is_one_joint(self._urdf):
            self.assumptions = (assumption_of(self._urdf),)
            self._inertia = likely_inertia(arm, base, episodes)
            arm = ArmRegressor(self._urdf, header.joints, self._gravity, self._inertia)
        self._scenario = scenario or Scenario()
        self._effects = tuple(self._scenario.effects)
        refuse_other_joints(self._effects, header.joints)
        # Shifts in time and filters need neighbours of rows that are not fitted.
        self._whole = self._motion_of(arm, base, header.joints, episodes)
        self._motion = self._whole
        filters = log_filters(logs)
        self._filtered = FilteredTorques(self._whole, filters) if filters else None
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

    @staticmethod
    def _motions(logs: Sequence[Log]) -> Sequence[Motion]:
        """Returns time, q, v and vd of each episode.

        Raises:
            DisasmError: one of them is not there.
        """
        episodes = [e for log in logs for e in log.episodes]
        _refuse_missing(episodes)
        return episodes

    @staticmethod
    def _base_set(arm: ArmRegressor) -> BaseSet:
        """Returns the inertial parameters that the kind of log can reveal."""
        return base_set(arm.random_regressor())

    @staticmethod
    def _motion_of(
        arm: ArmRegressor,
        base: BaseSet,
        joints: Sequence[str],
        motions: Sequence[Motion],
    ) -> ArmMotion:
        """Returns an arm's motion, see ArmMotion.of."""
        return ArmMotion.of(arm, base, joints, motions)

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        beta, on_arm = theta[: len(self._motion.nominal)], self._on_arm(theta)
        shifts = [e for e in on_arm if isinstance(e, DelayEffect) and not e.is_null]
        filtered = self._filtered if any(map(has_edges, on_arm)) else None
        if not shifts and filtered is None:
            return self._motion.rows(rows).torques(beta, on_arm)
        torque = self._whole.torques(beta, on_arm, filtered)
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

    def applicable_effects(self, library: Sequence[type[Effect]]) -> list[Effect]:
        """See LogModel; nothing is known of how an axis without a URDF is mounted.

        Bodies on links are what base parameters are, where those are not known.
        """
        found = super().applicable_effects(library)
        if self._inertia is not None:
            unknown: tuple[type[Effect], ...] = (ArmTilt, PayloadEffect)
        elif not self._knows_links:
            unknown = (LinkPayload,)
        else:
            unknown = ()
        last = self.joints[-1]  # its link is the flange's
        return [
            e
            for e in found
            if not isinstance(e, unknown)
            if not (isinstance(e, LinkPayload) and e.joint == last)
        ]

    def with_known_links(self) -> Self:
        """Returns the same model with bodies on any link among its effects."""
        return self.replace(_knows_links=True)

    def trusting_urdf(self) -> Self:
        """Returns the same model with the rigid bodies of the URDF.

        Raises:
            DisasmError: it is of one axis, which no URDF describes.
        """
        if self._inertia is not None:
            raise DisasmError("an axis without a URDF has no links to trust; give one")
        return self.only(()).with_known_links()

    @property
    def gravity(self) -> tuple[float, float, float]:
        """In the frame of the arm's base [m/s^2]."""
        return self._gravity

    @property
    def motion(self) -> ArmMotion:
        """Of the rows that the model predicts."""
        return self._motion

    @property
    def has_urdf(self) -> bool:
        """Whether the arm is a user's, and not a body that stands for an axis."""
        return self._inertia is None

    @property
    def has_free_bodies(self) -> bool:
        """Whether all base parameters vary: none was frozen."""
        return self._own_parameters is None

    def rigid_bodies(self) -> tuple[ArmRegressor, BaseSet]:
        """Returns the arm's nominal bodies, and which combinations of them vary."""
        arm = self._arm_under(np.array(self._gravity))
        return arm, self._base_set(arm)

    def unfitted(self) -> Self:
        """Returns the model of all rows that this one leaves out; itself if none.

        For predictions alone: its measurements are this one's.
        """
        mask = ~self._taken
        if not mask.any():
            return self
        return self.replace(_motion=self._whole.rows(mask), _taken=mask)

    @property
    def urdf(self) -> str:
        """See LogModel: as the logs or the caller say."""
        return self._urdf

    @property
    def travel(self) -> dict[str, float]:
        """See LogModel."""
        return travel_of(self.joints, self._motion.q)

    @property
    def one_way(self) -> tuple[str, ...]:
        """See LogModel."""
        return one_way_joints(self.joints, self._motion.dry_v)

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
                    f"parameter {name}: {self.of_base}; {closest(name, known)}"
                )
        rest = {p.name: p.nominal for p in base if p.name not in names}
        return self.freeze(rest)

    def _base_parameters(
        self, arm: ArmRegressor, base: BaseSet
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

    @property
    def signed_order(self) -> SignedOrder:
        """See LogModel."""
        return TorqueFits(self._motion, self.measurements.values).signed_order()

    def exchanged_motions(self, most: float) -> tuple[tuple[int, int], float] | None:
        """See LogModel."""
        fits = TorqueFits(self._motion, self.measurements.values)
        arm = self._arm_under(np.array(self._gravity))
        return fits.exchanged_motions(arm.regressor, most)

    def bookkeeping(self) -> list[Bookkeeping[Self]]:
        """See LogModel: rates and units first, on which the other ways rest."""
        rates = self._in_degrees() or self._wrong_rates()
        if rates:
            return rates
        fits = TorqueFits(self._motion, self.measurements.values)
        if not fits.are_known:
            return []
        columns = list(self._wrong_columns(fits))
        # Gravity is known by columns that are in their places.
        turned = [] if columns else list(self._turned(fits))
        return likely([*columns, *turned, *self._late(fits)])

    def _in_degrees(self) -> list[Bookkeeping[Self]]:
        rotary = np.array([j not in self._prismatic for j in self.joints])
        if not rotary.any() or median_reach(self._motion.q[:, rotary]) <= MOST_TURN:
            return []
        q = np.where(rotary, np.radians(self._whole.q), self._whole.q)
        whole = self._whole
        v, _ = right_rates(whole.time, whole.episode, q, whole.v)
        vd, _ = right_rates(whole.time, whole.episode, v, whole.vd)
        what = "joint positions are in degrees"
        remedy = "give `unit: deg` of q in the map of import-log"
        return [Bookkeeping("PositionUnit", what, remedy, self._rewritten(q, v, vd))]

    def _wrong_rates(self) -> list[Bookkeeping[Self]]:
        """Returns the velocities, or else accelerations, that are no derivatives."""
        whole = self._whole
        at = whole.time, whole.episode
        v, by = right_rates(*at, whole.q, whole.v)
        vd, by_v = right_rates(*at, v, whole.vd)
        for name, rate, factors in (
            ("Velocity", "v", by),
            ("Acceleration", "vd", by_v),
        ):
            off = np.flatnonzero(factors != 1.0)
            if len(off):
                own = f".{self.joints[off[0]]}" if len(off) == 1 else ""
                what = rate_text(rate, self.joints, factors)
                remedy = (
                    f"correct the unit, scale or sign of {rate} in the map of "
                    "import-log, or leave it out: import-log makes it from q"
                )
                model = self._rewritten(whole.q, v, vd)
                count = len(off)
                return [Bookkeeping(f"{name}Factor{own}", what, remedy, model, count)]
        return []

    def _wrong_columns(
        self, fits: TorqueFits
    ) -> Iterator[tuple[Bookkeeping[Self], float]]:
        """Yields another order, other signs and units of torques, with what is left."""
        order = self.signed_order
        if order.steps:
            yield self._in_order(order)
        for i, factor in fits.torque_units().items():
            scale = np.where(np.arange(len(self.joints)) == i, factor, 1.0)
            yield self._with_columns(
                f"TorqueUnit.{self.joints[i]}",
                f"the torque of {self.joints[i]} is {factor:g} times what it should be",
                f"correct the unit or scale of tau.{i} in the map of import-log",
                SignedOrder.as_written(len(self.joints)),
                scale,
            )

    def _in_order(self, order: SignedOrder) -> tuple[Bookkeeping[Self], float]:
        """Returns another order or other signs of torques, with what it leaves."""
        joints = self.joints
        name, text, scale = order.name(joints), order.text(joints), np.ones(len(joints))
        return self._with_columns(name, text, order.remedy, order, scale)

    def _with_columns(
        self, name: str, what: str, remedy: str, order: SignedOrder, scale: Array
    ) -> tuple[Bookkeeping[Self], float]:
        """Returns a way of writing torques, with what it leaves.

        Args:
            name, what, remedy: of Bookkeeping.
            order: of the columns.
            scale: (joints,) what each joint's torque is to be divided by.
        """
        measured = self.measurements
        columns = list(order.order)
        channels = tuple(
            dataclasses.replace(
                channel, noise=measured.channels[i].noise / s, origin=own.origin
            )
            for channel, i, s in zip(measured.channels, columns, scale, strict=True)
            for own in [measured.channels[i]]
        )
        values = measured.values @ (order.matrix / scale[:, None]).T
        right = dataclasses.replace(measured, values=values, channels=channels)
        model = self.with_measurements(right)
        lost = TorqueFits(self._motion, right.values).lost()
        return Bookkeeping(name, what, remedy, model), lost

    def _late(self, fits: TorqueFits) -> Iterator[tuple[Bookkeeping[Self], float]]:
        """Yields a delay of all torques, and what it leaves."""
        delay = fits.common_delay()
        if delay:
            late = "late" if delay.value > 0.0 else "early"
            what = (
                f"all torques are {late} by {1e3 * abs(delay.value):.3g} ms (standard "
                f"error {1e3 * delay.error:.2g} ms) against the motion"
            )
            remedy = (
                "stamp torques and motion by one clock, and pass both through one "
                "filter; or shift the torques by that in the log"
            )
            model = self.with_effects([*self.effects, ArmDelay(delay.value)])
            way = Bookkeeping("CommonDelay", what, remedy, model, 1)
            yield way, fits.lost(delay.value)

    def _turned(self, fits: TorqueFits) -> Iterator[tuple[Bookkeeping[Self], float]]:
        """Yields another gravity than the URDF's upright base has, or none."""
        written = np.array(self._gravity)
        if self._own_parameters is not None or not written.any():
            return  # base parameters are others under another gravity
        if self._inertia is not None:
            return  # nobody wrote how the axis stands
        found = fits.gravity(self._arm_under, written)
        if found is None:
            return
        if found.is_reversed:
            order = SignedOrder.as_written(len(self.joints))
            yield self._in_order(order.flipped(range(len(self.joints))))
            return
        gravity = found.vector
        if gravity.any():
            name, angle = "GravityDirection", angle_between(gravity, written)
            down = np.round(gravity / np.linalg.norm(gravity), 2).tolist()
            what = (
                f"the arm's base is turned by {np.degrees(angle):.0f} degrees: gravity "
                f"is along {down} in it"
            )
            remedy = (
                "turn the base in the URDF, by the joint that fixes it to the world"
            )
        else:
            name, what = "GravityRemoved", "the torques have no gravity in them"
            remedy = (
                "log what motors or sensors measure, or add the gravity torque that "
                "the controller takes away"
            )
        model = self._rewritten(gravity=gravity)
        lost = TorqueFits(model._motion, self.measurements.values).lost()
        yield Bookkeeping(name, what, remedy, model, 2 * int(gravity.any())), lost

    def _arm_under(self, gravity: Array) -> ArmRegressor:
        under = tuple(gravity.tolist())
        return ArmRegressor(self._urdf, self.joints, under, self._inertia)

    def _rewritten(
        self,
        q: Array | None = None,
        v: Array | None = None,
        vd: Array | None = None,
        gravity: Array | None = None,
    ) -> Self:
        """Returns the model of another motion (rows, joints), or of other gravity."""
        whole = self._whole
        parts = {
            "time": whole.time,
            "q": whole.q if q is None else q,
            "v": whole.v if v is None else v,
            "vd": whole.vd if vd is None else vd,
        }
        under = np.array(self._gravity) if gravity is None else gravity
        arm = self._arm_under(under)
        base = self._base_set(arm)
        episodes = [
            {name: part[whole.episode == number] for name, part in parts.items()}
            for number in np.unique(whole.episode)
        ]
        whole = self._motion_of(arm, base, whole.joints, episodes)
        known = self._filtered
        model = self.replace(
            _whole=whole,
            _motion=whole.rows(self._taken),
            _gravity=tuple(under),
            _filtered=FilteredTorques(whole, known.filters) if known else None,
        )
        of_base = model._base_parameters(arm, base)
        if gravity is not None:
            rest = [p for p in self.parameters if p.path]
            return model.replace(parameters=(*of_base, *rest))
        named = {p.name: p for p in of_base}
        renewed = tuple(named.get(p.name, p) for p in self.parameters)
        return model.replace(parameters=renewed)

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """See LogModel."""
        taken = self._taken.copy()
        taken[taken] = mask
        return self.replace(_motion=self._motion.rows(mask), _taken=taken)


def _refuse_missing(episodes: Sequence[Episode]) -> None:
    for episode in episodes:
        remedy = (
            "inverse dynamics needs q, v, vd and tau; map q and tau in import-log, "
            "which makes v and vd"
        )
        if "current" in episode:
            remedy = "its motor currents are torques by `motor_constants`; give them"
        for quantity in _NEEDED:
            if quantity not in episode:
                raise refusal(episode.path, f"no columns '{quantity}.*'", remedy)
