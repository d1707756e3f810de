"""Static readings of a force/torque sensor: payload, bias, and any sensor effect."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import UniformGravityFieldElement

from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError
from drake_disasm.devices.sensor_chain import Payload, sensed
from drake_disasm.effects import (
    Effect,
    PayloadError,
    Reach,
    Sensing,
    SensorEffect,
    SensorMemoryEffect,
    SensorResidualModel,
    sensor_chain,
)
from drake_disasm.logs import Episode, Log, rotation_matrices, sensor_wrench
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.schema import WRENCH
from drake_disasm.scenario import Scenario
from sysid.models.base import Array
from sysid.models.bookkeeping import Bookkeeping, Frame, Poses
from sysid.models.channel_grams import likely
from sysid.models.measurements import Channel, Measurements
from sysid.models.scenario_model import ScenarioModel
from sysid.models.wrench_bookkeeping import Readings, better_ways, has_no_weight
from sysid.parameters import Parameter

#: Mass, first moment and bias: all that a rigid load on an ideal sensor can have.
DEFAULT_PARAMETERS = tuple(
    f"{effect}.{field}"
    for effect, fields in (
        ("PayloadError", ("mass", "cx", "cy", "cz")),
        ("SensorBias", WRENCH),
    )
    for field in fields
)

_GRAVITY_W = UniformGravityFieldElement().gravity_vector()
_NOTHING = Payload(0.0, np.zeros(3), _GRAVITY_W)


class StaticWrenchModel(ScenarioModel):
    """The reading at rest: the known payload's weight, through the sensor's effects.

    The effects are those of the simulated sensor, the same code. Channels are the
    reading at So in S, in whatever frame the log states it.
    """

    affine = True
    #: Of logs, and whether that says that the sensor is at rest in each row.
    kind: ClassVar[str] = "static_wrench"
    at_rest: ClassVar[bool] = True
    effect_types = (SensorEffect,)
    residual_effect = SensorResidualModel

    def __init__(
        self,
        logs: Sequence[Log],
        scenario: Scenario,
        parameters: Sequence[Parameter],
        known_payload: bool = False,
    ) -> None:
        """Reads the log's readings.

        Args:
            logs: of static readings.
            scenario: its sensor effects act; parameters are paths in it.
            parameters: of sensor effects.
            known_payload: whether the scenario's tool is mounted on the sensor, so
                that PayloadError is the error of its data. Otherwise PayloadError is
                the whole payload.

        Raises:
            DisasmError: a log is of another kind, or a parameter is of something
                else than a sensor effect.
        """
        self.refuse_other_kinds(logs)
        self.parameters, self.scenario = tuple(parameters), scenario
        self._g_W = _GRAVITY_W
        self._in_W = all(log.header.frames.get("wrench") == "W" for log in logs)
        self._payload = _payload(scenario) if known_payload else _NOTHING
        episodes = [episode for log in logs for episode in log.episodes]
        self._R_WS = np.concatenate(
            [rotation_matrices(episode["R_WS"]) for episode in episodes]
        )
        self._time = np.concatenate([_clock(episode) for episode in episodes])
        self._has_time = all("time" in episode for episode in episodes)
        self.measurements = Measurements.of_logs(
            logs, _channels(), lambda log, e: sensor_wrench(log.header, e)
        )
        self._refuse_other_parameters()

    @classmethod
    def refuse_other_kinds(cls, logs: Sequence[Log]) -> None:
        """Refuses logs that are not of the model's kind.

        Raises:
            DisasmError: one is not.
        """
        for log in logs:
            if log.header.kind != cls.kind:
                raise refusal(
                    log.folder / "log.yaml",
                    f"a log of kind '{log.header.kind}', where '{cls.kind}' is needed",
                    "name such a log",
                )

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        return self.reading(theta, self._time[rows], self._R_WS[rows])

    def reading(self, theta: Array, time: Array, R_WS: Array) -> Array:
        """Returns readings (n, 6) in free space [N, N m].

        Args:
            theta: (p,) values of `parameters`.
            time: (n,) since the log began [s].
            R_WS: (n, 3, 3) orientations of the sensor.
        """
        effects = sensor_chain(self.scenario_at(theta).effects)
        sensing = Sensing(time, R_WS, self._g_W)
        return sensed(self._payload.weight(R_WS), effects, sensing)

    @property
    def orientations(self) -> Array:
        """R_WS (rows, 3, 3) of the readings."""
        return self._R_WS

    def frames(self, rows: NDArray[np.int64]) -> list[Frame]:
        """See LogModel: readings may be written in W."""
        if not self._in_W:
            return [Frame()]
        R_WS = self._R_WS[rows]
        R_SW = R_WS.swapaxes(1, 2)
        in_W = Frame("in W", lambda v: _rotated(R_WS, v), lambda v: _rotated(R_SW, v))
        return [in_W, Frame("in S")]

    @property
    def poses(self) -> Poses | None:
        """See LogModel; None where only an order is known, and no time."""
        if not self._has_time:
            return None
        return Poses(self._time, self._turned, self._R_WS, self.at_rest)

    def _turned(self, rows: NDArray[np.int64], others: NDArray[np.int64]) -> Array:
        """Returns the angle (n,) between the orientations of rows [rad]."""
        trace = np.einsum("nij,nij->n", self._R_WS[rows], self._R_WS[others])
        return np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))

    @property
    def reach(self) -> Reach:
        """See LogModel."""
        return Reach(float(self._time.max()))

    @property
    def noise_groups(self) -> tuple[str, ...]:
        """Force axes share one unknown noise, torque axes another.

        Estimated one by one, an axis that happens to fit well would outweigh the
        others.
        """
        return tuple(channel.unit for channel in self.measurements.channels)

    def describe(self, theta: Array) -> dict[str, tuple[float, str]]:
        """Returns weight and centre of mass of the PayloadError."""
        for effect in self.scenario_at(theta).effects:
            if isinstance(effect, PayloadError) and effect.mass != 0.0:
                moment = {"x": effect.cx, "y": effect.cy, "z": effect.cz}
                weight = effect.mass * float(np.linalg.norm(self._g_W))
                centre = {
                    f"centre of mass {axis}": (value / effect.mass, "m")
                    for axis, value in moment.items()
                }
                return {"weight": (weight, "N"), **centre}
        return {}

    def residual_inputs(self, theta: Array) -> dict[str, Array]:
        """See LogModel."""
        sensing = Sensing(self._time, self._R_WS, self._g_W)
        inputs = SensorResidualModel.inputs_of(self.predictions(theta), sensing)
        return {channel.name: inputs for channel in self.measurements.channels}

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel: time, and gravity's direction in S."""
        down = np.einsum("nji,j->ni", self._R_WS, self._g_W)
        axes = {f"gravity along {a}_S": down[:, i] for i, a in enumerate("xyz")}
        return {"time": self._time, **axes}

    def bookkeeping(self) -> list[Bookkeeping[Self]]:
        """See LogModel."""
        readings = Readings(self._R_WS, self.measurements.values, self._g_W, self._in_W)
        known = self._payload.mass * float(np.linalg.norm(self._g_W))
        ways = likely(better_ways(readings))
        if not ways and has_no_weight(readings, known):
            return list(self._without_weight(known))
        return [
            Bookkeeping(
                way.name, way.what, way.remedy, self._read(way.readings), way.estimated
            )
            for way in ways
        ]

    def _read(self, readings: Readings) -> Self:
        """Returns the model of the same readings, written otherwise."""
        return self.replace(
            _R_WS=readings.R_WS,
            _g_W=readings.g_W,
            _in_W=readings.in_W,
            _payload=dataclasses.replace(self._payload, g_W=readings.g_W),
            measurements=self.measurements.with_values(readings.wrench),
        )

    def _without_weight(self, known: float) -> Iterator[Bookkeeping[Self]]:
        """Yields a wrench without the weight that is known [N]."""
        carried = [
            p.name
            for p in self.parameters
            if isinstance(
                self.scenario.effects[int(p.path.split(".")[1])], PayloadError
            )
        ]
        what = f"the wrench has no weight in it, of {known:.3g} N on the sensor"
        remedy = (
            "record the sensor's raw reading, before the controller takes the weight "
            "of the tool away"
        )
        model = self.replace(_payload=_NOTHING).freeze(dict.fromkeys(carried, 0.0))
        yield Bookkeeping("WeightRemoved", what, remedy, model)

    def _refuse_other_parameters(self) -> None:
        for parameter in self.parameters:
            head, _, rest = parameter.path.partition(".")
            number = rest.partition(".")[0]
            effect = self.scenario.effects[int(number)] if head == "effects" else None
            if not isinstance(effect, SensorEffect):
                raise DisasmError(
                    f"parameter {parameter.name}: static readings do not depend on "
                    "it; name sensor effects, such as PayloadError.mass SensorBias.fx"
                )

    def applicable_effects(self, library: Sequence[type[Effect]]) -> list[Effect]:
        """See LogModel; without memory, of which readings at rest know nothing."""
        at_rest = [k for k in library if not issubclass(k, SensorMemoryEffect)]
        return super().applicable_effects(at_rest)

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        """See LogModel."""
        return self.replace(_R_WS=self._R_WS[mask], _time=self._time[mask])


def _rotated(R: Array, wrench: Array) -> Array:
    """Returns wrenches (n, 6) turned by (n, 3, 3)."""
    return np.einsum("nij,nkj->nki", R, wrench.reshape(-1, 2, 3)).reshape(-1, 6)


def _payload(scenario: Scenario) -> Payload:
    if scenario.ft_sensor.place == "part":
        raise DisasmError(
            "ft_sensor.place: a sensor under the part never turns, so its readings at "
            "rest tell nothing; give logs of transitions"
        )
    tool = Tool.from_models(scenario)
    return Payload(tool.mass, tool.p_SoScm_S, _GRAVITY_W)


def _clock(episode: Episode) -> Array:
    """Returns the time (rows,) since the log began [s], or else the readings' order."""
    clock: Array = episode["time"] if "time" in episode else episode["order"]
    return clock - clock[0]


def _channels() -> tuple[Channel, ...]:
    units = ["N"] * 3 + ["N m"] * 3
    return tuple(
        Channel(name, unit, np.nan, "estimated")
        for name, unit in zip(WRENCH, units, strict=True)
    )
