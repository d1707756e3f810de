"""A closed loop as a reference: all that is needed to judge other logs by its model."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_json
from drake_disasm.common.plain_data import check_like
from drake_disasm.logs import Log, read_logs
from drake_disasm.parts import import_own
from drake_disasm.scenario import scenario_from_mapping, scenario_to_mapping
from sysid.data_checks import check_data, without_flagged_rows
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.fitting.candidates import Candidate, extended
from sysid.models import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.monitoring.plain_effects import candidates_of, mappings_of
from sysid.motor_constants import given_constants
from sysid.scenario_parameters import ParameterRequest

#: In `result.json`; and what a reader of this version understands.
KEY, LAYOUT = "as_reference", 1
_AGAIN = "close the loop again on those logs"
_EXAMPLE: dict[str, Any] = {
    "layout": LAYOUT,
    "kind": "",
    "joints": [""],
    "logs": {},
    "fitted": [""],
    "scenario": None,
    "requests": [{"name": ""}],
    "urdf": None,
    "trust_urdf": False,
    "imports": [""],
    "drop_flagged_rows": False,
    "motor_constants": [0.0],
    "effects": [{"effect": {}, "fields": [""]}],
    "values": {},
    "noise": [0.0],
    "noise_is_stated": False,
    "residual": [0.0],
    "huber_delta": None,
    "written": [""],
    "provisional": False,
}


@dataclass(frozen=True)
class Reference:
    """The model that a closed loop ended with.

    Attributes:
        kind, joints: of its logs.
        logs: hash of each log's data by its folder.
        fitted: names of the episodes that its values were fitted to.
        choice: of the model.
        imports: modules or files of effects.
        drop_flagged_rows: whether rows that the check of the data flags are left out.
        motor_constants: by which currents of its logs are torques [N m/A]; empty for
            logs of torques.
        effects: that were added, in the shapes in which they were selected.
        values: of all parameters, the effects' included, by name.
        noise: of each channel, SI.
        noise_is_stated: whether that is known, and no estimate.
        residual: rms of each channel's residual, in units of the noise.
        huber_delta: residual, in standard deviations, beyond which weights fall.
        written: how the logs were written in place of what they say, by name.
        is_provisional: whether the time was over before the search was.
    """

    kind: str
    joints: tuple[str, ...]
    logs: Mapping[Path, str]
    fitted: tuple[str, ...]
    choice: ModelChoice
    imports: tuple[str, ...]
    drop_flagged_rows: bool
    motor_constants: tuple[float, ...]
    effects: tuple[Candidate, ...]
    values: Mapping[str, float]
    noise: tuple[float, ...]
    noise_is_stated: bool
    residual: tuple[float, ...]
    huber_delta: float
    written: tuple[str, ...]
    is_provisional: bool

    @classmethod
    def of(
        cls,
        closed: ClosedLoop,
        logs: Sequence[Log],
        choice: ModelChoice,
        imports: Sequence[str] = (),
        drop_flagged_rows: bool = False,
        motor_constants: Sequence[float] = (),
    ) -> Self:
        """Returns a closed loop as a reference.

        Args:
            closed: of the logs.
            logs: all of them.
            choice: of their model.
            imports: modules or files that were imported for it.
            drop_flagged_rows, motor_constants: see the class.
        """
        last = closed.last
        residual = np.sqrt(np.mean(last.linearisation.residual**2, axis=0))
        if choice.urdf and Path(choice.urdf).exists():
            choice = dataclasses.replace(choice, urdf=str(Path(choice.urdf).resolve()))
        return cls(
            logs[0].header.kind,
            logs[0].header.joints,
            {log.folder.resolve(): log.data_hash for log in logs},
            last.model.measurements.names,
            choice,
            tuple(_absolute(name) for name in imports),
            drop_flagged_rows,
            tuple(motor_constants),
            last.effects,
            last.values,
            tuple(last.model.measurements.noise.tolist()),
            last.noise_is_stated,
            tuple(residual.tolist()),
            last.linearisation.huber_delta,
            tuple(each.name for each in closed.verdict.written),
            closed.is_provisional,
        )

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Returns the reference in the output folder of `drake-disasm close-loop`.

        Raises:
            DisasmError: there is none, it is of an older layout, or its logs are not
                what they say.
        """
        path = folder / "result.json"
        content = read_json(
            path, "name the --out folder of `drake-disasm close-loop`", {}
        )
        if "courses" in content:
            raise DisasmError(
                f"{folder}: is a comparison of logs; name the closed loop of the "
                "references alone"
            )
        raw = content.get(KEY)
        if not isinstance(raw, dict) or raw.get("layout") != LAYOUT:
            raise DisasmError(f"{path}: is of another version; {_AGAIN}")
        try:
            check_like(raw, _EXAMPLE)
            found = cls.from_mapping(raw)
        except DisasmError as error:
            raise DisasmError(f"{path}: {error}; {_AGAIN}") from None
        if found.written:
            raise DisasmError(
                f"{folder}: its logs are not what they say "
                f"({', '.join(found.written)}); correct them as its verdict says, and "
                "close the loop again"
            )
        return found

    @classmethod
    def from_mapping(cls, raw: Mapping[str, Any]) -> Self:
        """Returns the reference that plain data describe, see `to_mapping`.

        Raises:
            DisasmError: an effect is not known, or can't be imported.
        """
        for name in raw["imports"]:
            import_own(name)
        scenario = raw["scenario"]
        choice = ModelChoice(
            scenario=scenario_from_mapping(scenario) if scenario else None,
            requests=tuple(ParameterRequest(**each) for each in raw["requests"]),
            urdf=raw["urdf"],
            fixed=True,
            trust_urdf=raw["trust_urdf"],
        )
        delta = raw["huber_delta"]
        return cls(
            raw["kind"],
            tuple(raw["joints"]),
            {Path(name): digest for name, digest in raw["logs"].items()},
            tuple(raw["fitted"]),
            choice,
            tuple(raw["imports"]),
            raw["drop_flagged_rows"],
            tuple(raw["motor_constants"]),
            candidates_of(raw["effects"]),
            raw["values"],
            tuple(raw["noise"]),
            raw["noise_is_stated"],
            tuple(raw["residual"]),
            math.inf if delta is None else delta,
            tuple(raw["written"]),
            raw["provisional"],
        )

    def to_mapping(self) -> dict[str, Any]:
        """Returns all of it as plain data, for `result.json`."""
        scenario, delta = self.choice.scenario, self.huber_delta
        return {
            "layout": LAYOUT,
            "kind": self.kind,
            "joints": list(self.joints),
            "logs": {str(folder): digest for folder, digest in self.logs.items()},
            "fitted": list(self.fitted),
            "scenario": scenario_to_mapping(scenario) if scenario else None,
            "requests": [dataclasses.asdict(each) for each in self.choice.requests],
            "urdf": self.choice.urdf,
            "trust_urdf": self.choice.trust_urdf,
            "imports": list(self.imports),
            "drop_flagged_rows": self.drop_flagged_rows,
            "motor_constants": list(self.motor_constants),
            "effects": mappings_of(self.effects),
            "values": dict(self.values),
            "noise": list(self.noise),
            "noise_is_stated": self.noise_is_stated,
            "residual": list(self.residual),
            "huber_delta": None if math.isinf(delta) else delta,
            "written": list(self.written),
            "provisional": self.is_provisional,
        }

    def read_logs(self) -> tuple[Log, ...]:
        """Returns its logs.

        Raises:
            DisasmError: one is gone, or its data are others.
        """
        for folder in self.logs:
            if not folder.is_dir():
                raise DisasmError(f"{folder}: the reference's log is gone; {_AGAIN}")
        logs = read_logs(self.logs)
        for log in logs:
            if log.data_hash != self.logs[log.folder]:
                raise DisasmError(
                    f"{log.folder}: the reference's log has changed since; {_AGAIN}"
                )
        return logs

    def refuse_other(self, log: Log) -> None:
        """Refuses a log of another kind or robot.

        Raises:
            DisasmError: it is one.
        """
        header = log.header
        for what, own, other in (
            ("kind", self.kind, header.kind),
            ("joints", self.joints, header.joints),
        ):
            if own != other:
                raise DisasmError(
                    f"{log.folder}: its {what} is {other}, the reference's {own}; "
                    "name logs of the reference's robot"
                )

    def model(self, logs: Sequence[Log]) -> LogModel:
        """Returns the model of logs, with its effects, and all parameters to vary.

        Raises:
            DisasmError: the logs are of another robot, or lack what the model needs.
        """
        for log in logs:
            self.refuse_other(log)
        if self.motor_constants:
            constants = given_constants(self.joints, self.motor_constants)
            logs = constants.torques(logs)
        model = model_of(logs, self.choice)
        if self.drop_flagged_rows:
            model = without_flagged_rows(logs, model, check_data(logs, model))
        measured = model.measurements
        if len(measured.channels) != len(self.noise):
            raise DisasmError(
                f"{logs[0].folder}: has {len(measured.channels)} channels, the "
                f"reference {len(self.noise)}; measure the same"
            )
        known = measured.with_noise(np.array(self.noise), "reference")
        model = model.with_measurements(known).with_known_links()
        model, _ = extended(model, self.effects, with_shapes=True)
        odd = {p.name for p in model.parameters} ^ set(self.values)
        if odd:
            raise DisasmError(
                f"{logs[0].folder}: its model's parameters are not the reference's "
                f"({min(odd)}); name logs of the reference's robot"
            )
        return model


def _absolute(name: str) -> str:
    """Returns a file's absolute path; a module's name as it is."""
    return str(Path(name).resolve()) if Path(name).is_file() else name
