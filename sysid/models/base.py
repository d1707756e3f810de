"""What identification and closing the loop work on: a model that predicts a log."""

import abc
import copy
import itertools
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import Effect, Reach
from drake_disasm.scenario import Scenario
from sysid.models.bookkeeping import Assumption, Bookkeeping, Frame, Poses
from sysid.models.effects import (
    at_null,
    field_of,
    is_shown,
    with_fields,
    within_reach,
)
from sysid.models.measurements import Measurements
from sysid.models.signed_order import SignedOrder
from sysid.models.validity import Validity
from sysid.parameters import Parameter, by_name, by_path

Array = NDArray[np.float64]

#: Residual, in standard deviations, beyond which the loss of a model that simulates
#: is linear: a stop that is hit a moment later than measured is an outlier.
HUBER_DELTA = 3.0


class PredictionError(Exception):
    """A model can't be evaluated at these parameters: the simulation failed."""


class LogModel(abc.ABC):
    """Predicts the channels of a log from parameters, and from effects.

    A model of your own sets `parameters` and `measurements` and implements `predict`
    and `select_rows`; everything else has a default. To close the loop with it, name
    the classes of effects that `predict` applies in `effect_types`:

        class Pendulum(LogModel):
            effect_types = (JointEffect,)

            def __init__(self, q, v, tau):
                self.q, self.v = q, v
                self.parameters = (Parameter("weight", 1.0, 0.0, 5.0, "N m"),)
                channels = [Channel("pivot", "N m", noise=0.01)]
                self.measurements = Measurements.of_array(tau, channels)

            def predict(self, theta, rows):
                load = theta[0] * np.sin(self.q[rows])
                samples = JointSamples(self.q[rows], self.v[rows], 0 * load, load)
                return load + sum(e.torque(samples) for e in self.effects_at(theta))

            def select_rows(self, mask):
                return self.replace(q=self.q[mask], v=self.v[mask])

    Models are immutable: methods return changed copies. A model is pickled for the
    processes that evaluate it, which have to be able to import its class; what it
    builds there, such as a diagram, it leaves out of the pickle by `__getstate__`.

    Attributes:
        parameters: what can be varied, in the order of theta.
        measurements: what predictions are compared with.
        affine: whether predictions are affine in the parameters, and in the
            amplitudes of effects: least squares then has one exact solution.
        effect_types: base classes of the effects that `predict` applies.
        held_out_share: share of the episodes that closing the loop holds out; with 0,
            contiguous blocks of rows are held out in turn, each predicted by a fit to
            all others.
        makes_contact: whether predictions may change at once, where contact is made or
            lost: derivatives far from the data then promise nothing, and effects are
            compared by fits.
        setting: in which its logs are recorded, and others should be: "task" for steps
            of the task, "rest" for an arm at rest; "" for any.
        shown_elsewhere: classes of effects that other kinds of logs show: one of its
            own need not, for a verdict that nothing is missing.
        is_of_changes: whether effects are what changed since other logs.
        assumptions: that a check of the data reports.
        rows_in_use: of each episode's table, by the episode's name; empty: all rows.
    """

    parameters: tuple[Parameter, ...]
    measurements: Measurements
    affine: bool = False
    effect_types: ClassVar[tuple[type[Effect], ...]] = ()
    held_out_share: ClassVar[float] = 0.0
    makes_contact: ClassVar[bool] = True
    setting: ClassVar[str] = ""
    shown_elsewhere: ClassVar[tuple[type[Effect], ...]] = ()
    is_of_changes: ClassVar[bool] = False
    assumptions: tuple[Assumption, ...] = ()
    rows_in_use: Mapping[str, NDArray[np.int64]] = {}
    _effects: tuple[Effect, ...] = ()
    _own_parameters: tuple[Parameter, ...] | None = None  # None: none was frozen
    _frozen: Mapping[str, float] = {}
    _looks_ahead: float = 1.0  # times as long as the log

    @abc.abstractmethod
    def predict(self, theta: Array, rows: slice) -> Array:
        """Returns the predicted channels (len(rows), channels), SI.

        Of a single channel, (len(rows),) will do.

        Args:
            theta: values of the parameters that the model was made with, in their
                order and whether frozen or not, then those of the effects.
            rows: one of `chunks`.

        Raises:
            PredictionError: the simulation failed.
        """

    @abc.abstractmethod
    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """Returns a model whose inputs are those of some rows.

        Call `of_rows` instead, which takes care of measurements, parameters and
        effects.

        Args:
            mask: (rows,) true for the rows to take.
        """

    # Effects: those that the model has, and those that it could have.

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects at their nominal values."""
        return self._effects

    @property
    def joints(self) -> tuple[str, ...]:
        """Where effects that act at a joint may act; by default at each channel."""
        return tuple(channel.name for channel in self.measurements.channels)

    @property
    def reach(self) -> Reach:
        """How far the log goes, in the time of effects."""
        return Reach()

    @property
    def _reach_ahead(self) -> Reach:
        return self.reach.longer(self._looks_ahead)

    @property
    def travel(self) -> Mapping[str, float]:
        """How far each joint moves, from end to end [rad or m]; empty: not known."""
        return {}

    @property
    def piece(self) -> NDArray[np.int64]:
        """Of each row (rows,) its piece: predictions may jump between two; episodes."""
        return self.measurements.episode

    @property
    def filter_rows(self) -> int:
        """Over how many rows a filter of the log correlates noise; 1: there is none."""
        return 1

    @property
    def one_way(self) -> tuple[str, ...]:
        """Joints that move one way only; by default none is known."""
        return ()

    def effects_at(self, theta: Array) -> tuple[Effect, ...]:
        """Returns the effects with values of parameters (p,), as `predict` gets it."""
        own = [p for p in self.parameters if field_of(p)]
        values = by_name(own, theta[len(theta) - len(own) :])
        return with_fields(self._effects, by_path(own, values))

    def applicable_effects(self, library: Sequence[type[Effect]]) -> list[Effect]:
        """Returns the effects that the model may lack, at null.

        One for each place where it can act, and each combination of its shape
        parameters' grids.

        Args:
            library: classes of effects; those not of `effect_types` are passed over,
                and those that are not physical or act on the variance alone.
        """
        travel, one_way = self.travel, self.one_way
        return [
            effect
            for kind in library
            if issubclass(kind, self.effect_types)
            if kind.is_physical and not kind.is_random
            for effect in at_null(kind, self.joints, self._reach_ahead)
            if is_shown(effect, travel, one_way)
        ]

    def with_effects(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter] = ()
    ) -> Self:
        """Returns the same model with other effects.

        Args:
            effects: all of them; those that the model has come first.
            parameters: additional ones, fields of effects: their paths are
                `effects.0.size` and the like.
        """
        added = within_reach(parameters, effects, self.travel, self._reach_ahead)
        return self.replace(
            _effects=tuple(effects), parameters=(*self.parameters, *added)
        )

    def looking_ahead(self, times: float) -> Self:
        """Returns the same model, whose effects may be as slow as a longer log shows.

        Args:
            times: as long as this.
        """
        return self.replace(_looks_ahead=times)

    # Which parameters vary.

    def with_known_links(self) -> Self:
        """Returns the same model with bodies on any link among its effects.

        For a comparison with references, or with a URDF; itself if it has no links.
        """
        return self

    def freeze(self, values: Mapping[str, float]) -> Self:
        """Returns the same model with some parameters fixed at values, by name."""
        of_effects = [p for p in self.parameters if field_of(p)]
        own = tuple(p for p in self.parameters if not field_of(p))
        return self.replace(
            parameters=tuple(p for p in self.parameters if p.name not in values),
            _effects=with_fields(self._effects, by_path(of_effects, values)),
            _own_parameters=self._own_parameters or own,
            _frozen={**self._frozen, **values},
        )

    def with_frozen(self, theta: Array) -> Array:
        """Returns parameters (p,) with the values of frozen ones in their places.

        Frozen parameters of effects have none: their values are in the effects.
        """
        if self._own_parameters is None:
            return theta
        values = {**self._frozen, **by_name(self.parameters, theta)}
        own = [values[p.name] for p in self._own_parameters]
        count = sum(bool(field_of(p)) for p in self.parameters)
        return np.concatenate([own, theta[len(theta) - count :]])

    def scenario_at(self, theta: Array) -> Scenario | None:
        """Returns the scenario at parameters (p,), for a model that has one."""
        return None

    # Which rows.

    def of_rows(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the same model of the rows where the mask (rows,) is true."""
        kept = ("parameters", "_effects", "_own_parameters", "_frozen")
        return self.select_rows(mask).replace(
            measurements=self.measurements.select(mask),
            **{name: self.__dict__[name] for name in kept if name in self.__dict__},
        )

    def of_episodes(self, episodes: Sequence[int]) -> Self:
        """Returns the same model of some of the episodes.

        Raises:
            DisasmError: they have no row.
        """
        mask = np.isin(self.measurements.episode, episodes)
        if not mask.any():
            raise DisasmError("no episode is left to fit; hold out fewer")
        return self.of_rows(mask)

    def thin(self, every: int) -> Self:
        """Returns the same model of every n-th row."""
        return self.of_rows(np.arange(self.measurements.rows) % every == 0)

    def with_measurements(self, measurements: Measurements) -> Self:
        """Returns the same model compared with other measurements of the same rows."""
        return self.replace(measurements=measurements)

    # How predictions are computed, and what that costs.

    @property
    def costly(self) -> bool:
        """Whether an evaluation takes seconds: searches then evaluate fewer rows."""
        return False

    def surrogate(self) -> Self:
        """Returns a faster model with the same parameters; itself if there is none.

        Differences of its predictions serve as derivatives of this one's.
        """
        return self

    def chunks(self) -> list[slice]:
        """Returns the rows of each piece of work that an evaluation consists of."""
        return [slice(0, self.measurements.rows)]

    @property
    def together(self) -> int:
        """How many parameter sets `simulate_all` takes with profit."""
        return 1

    @property
    def simulated(self) -> NDArray[np.bool_]:
        """Which parameters (p,) `simulate` depends on."""
        return np.ones(len(self.parameters), dtype=bool)

    def simulate(self, theta: Array, rows: slice) -> Array:
        """Returns the part of a prediction that takes long, (len(rows), k).

        Parameters that `simulated` leaves out do not change it: many predictions
        may share one.

        Args:
            theta: (p,) values of `parameters`.
            rows: one of `chunks`.

        Raises:
            PredictionError: the simulation failed.
        """
        predicted = np.asarray(self.predict(self.with_frozen(theta), rows))
        return predicted[:, None] if predicted.ndim == 1 else predicted

    def simulate_all(self, thetas: Array, rows: slice) -> list[Array | str]:
        """Returns what `simulate` gives of parameter sets (k, p), or why it can't.

        Here one after the other; a model that simulates many at once overrides it.
        """
        return [self._outcome(theta, rows) for theta in thetas]

    def _outcome(self, theta: Array, rows: slice) -> Array | str:
        """Returns a simulation of finite numbers, or why there is none."""
        try:
            simulated = self.simulate(theta, rows)
        except PredictionError as error:
            return str(error)
        if not np.isfinite(simulated).all():
            return "the prediction is not finite"
        return simulated

    def read(self, theta: Array, rows: slice, simulated: Array) -> Array:
        """Returns the prediction (len(rows), channels) from what `simulate` gave."""
        return simulated

    def predictions(self, theta: Array) -> Array:
        """Returns predictions of all rows (rows, channels), in this process.

        Args:
            theta: (p,) values of `parameters`.

        Raises:
            PredictionError: the simulation failed.
        """
        parts = [self.simulate(theta, rows) for rows in self.chunks()]
        return self.read(theta, slice(0, self.measurements.rows), np.concatenate(parts))

    def with_begins(self, theta: Array | None) -> Self:
        """Returns the same model with steps that begin as they do at parameters (p,).

        How a step begins is measured through what the parameters describe: predictions
        then take it as given. Itself, if that makes no noticeable difference.

        Args:
            theta: None: as they do at whatever parameters a prediction is asked for.
                Derivatives are then those along the parameters.
        """
        return self

    def validity(self, theta: Array) -> Validity | None:
        """Returns whether the stated error holds at parameters (p,); None: unknown."""
        return None

    # How a fit weighs and describes.

    @property
    def default_huber_delta(self) -> float:
        """Residual, in standard deviations, beyond which the loss is linear.

        Infinite where the model is affine: least squares then has one exact optimum.
        And where no contact is made or broken, which is why single rows are far off:
        of an arm that lacks its friction all are.
        """
        is_bent = self.makes_contact and not self.affine
        return HUBER_DELTA if is_bent else np.inf

    @property
    def noise_groups(self) -> tuple[str, ...]:
        """For each channel a label; channels of one label have one unknown noise."""
        return tuple(channel.name for channel in self.measurements.channels)

    def describe(self, theta: Array) -> dict[str, tuple[float, str]]:
        """Returns derived quantities at parameters (p,): value and unit, by name."""
        return {}

    def covariates(self, channel: int) -> dict[str, Array]:
        """Returns what a channel's residual might depend on, (rows,) each, by name."""
        return {}

    #: The kind of effect that can stand for what others leave; None for no such.
    residual_effect: ClassVar[type[Effect] | None] = None

    def residual_inputs(self, theta: Array) -> dict[str, Array]:
        """Returns what `residual_effect` knows of each channel's rows, (rows, k).

        Args:
            theta: (p,) values of `parameters`.
        """
        return {}

    # What checks of the data ask.

    @property
    def urdf(self) -> str | None:
        """Where the arm's URDF is; None if there is none."""
        return None

    @property
    def poses(self) -> Poses | None:
        """In which rows were read that should be at rest; None: they need not be."""
        return None

    def frames(self, rows: NDArray[np.int64]) -> list[Frame]:
        """Returns the frame of the log's table, then the model's own, if another.

        Args:
            rows: (n,) numbers of those that the frames are for.
        """
        return [Frame()]

    @property
    def signed_order(self) -> SignedOrder | None:
        """In which order, and with which signs, channels are explained by far best.

        As written, unless another one leaves less than half. None: it is not known.
        """
        return None

    def exchanged_motions(self, most: float) -> tuple[tuple[int, int], float] | None:
        """Returns the two joints whose motions are exchanged, and what is left.

        None if there are none.

        Args:
            most: share of the error that is left may be, for a change to be one.
        """
        return None

    def bookkeeping(self) -> list[Bookkeeping[Self]]:
        """Returns how the log may have been written otherwise than it says.

        Those ways that its rows speak for; none is known by default.
        """
        return []

    # Copies.

    def replace(self, **attributes: Any) -> Self:
        """Returns a copy with other attributes, without what the model has built."""
        copied = copy.copy(self)
        copied.__dict__.update(attributes)
        return copied

    def __getstate__(self) -> dict[str, Any]:
        """Returns what is pickled and copied; a model that builds leaves that out."""
        return self.__dict__


def even_chunks(rows: int, size: int) -> list[slice]:
    """Returns slices of equal size, at most `size`, that cover all rows."""
    ends = np.linspace(0, rows, -(-rows // size) + 1).round().astype(int)
    return [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]
