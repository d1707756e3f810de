"""Which friction a real servo has: six models made by hand, and what the loop finds.

    python benchmarks/servo_friction.py ../shared/data/servo_pendulum --out out/servo

A servo swings a pendulum in four motions at three gains (Duclusaud, Passault, Padois
and Ly, Extended Friction Models for the Physics Simulation of Servo Actuators, ICRA
2025). Their models M1 to M6 are fitted here to two motions at the gains 100 and 200,
by the same simulation that closing the loop uses, and so is what that finds by itself.
Each is judged as there: by the mean absolute error of the position over whole runs, on
the other motions and on the gain 400.
"""

import argparse
import csv
import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from results import Cell, add_results_argument, markdown, write_result

from drake_disasm.common.files import write_json
from drake_disasm.common.program import ProgressBar, argument_parser, run
from drake_disasm.effects import (
    Effect,
    JointCoulombFriction,
    JointEffect,
    JointLoadFriction,
    JointQuadraticFriction,
    JointSamples,
    JointStribeckFriction,
    JointViscousFriction,
    RotorInertia,
)
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.logs import Log, LogHeader, LogWriter, flat_columns, read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.fitting.candidates import Candidate, extended
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models.response.model import JointResponseModel
from sysid.workers import Workers

_NAME = "benchmarks/servo_friction.py"
_JOINT = "servo"
_MOTIONS = ("sin_sin", "sin_time_square", "lift_and_drop", "up_and_down")
_FITTED = ("sin_sin", "lift_and_drop")
_DUTY = 0.00254  # per radian and unit of the gain, by the servo's own `load`
_URDF = """<robot name="pendulum"><link name="base"/><link name="arm"><inertial>
<origin xyz="0 0 -0.1"/><mass value="0.49"/>
<inertia ixx="1e-9" ixy="0" ixz="0" iyy="1e-9" iyz="0" izz="1e-9"/></inertial></link>
<joint name="servo" type="revolute"><parent link="base"/><child link="arm"/>
<axis xyz="0 1 0"/><limit effort="5" lower="-7" upper="7" velocity="50"/></joint>
</robot>"""


@dataclasses.dataclass
class JointDirectionalFriction(JointEffect):
    """A gear that loses more while the motor drives the load than while it is driven.

    tau = k tau_load tanh(v / e)^2, beside friction in proportion to the load: what M5
    has beyond M4. It is not in the library: a torque sensor's gain looks like it.
    """

    joint: str = joint_name()
    coefficient: float = amplitude("1", -0.9, 0.9, "half of the difference")
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 0.1, "velocity of the transition", (0.02,)
    )

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        moving = np.tanh(samples.v / self.creep) ** 2
        return self.coefficient * samples.load * moving


#: From where each kind of friction is sought; the best of both counts.
_STARTS: tuple[Mapping[type[Effect], float], ...] = (
    {RotorInertia: 0.002, JointCoulombFriction: 0.01, JointViscousFriction: 0.002},
    {
        RotorInertia: 0.001,
        JointCoulombFriction: 0.02,
        JointViscousFriction: 0.002,
        JointStribeckFriction: 0.02,
        JointLoadFriction: 0.4,
        JointQuadraticFriction: 0.2,
    },
)


def main(arguments: Sequence[str]) -> int:
    """Fits, closes the loop, and prints the table."""
    args = parse(arguments)
    logs = written_logs(args.data, args.out / "logs")
    fitted = [f"{motion}_kp{gain}" for motion in _FITTED for gain in (100, 200)]
    runs = _runs(logs, fitted)
    table: dict[str, Any] = {}
    with ProgressBar(unit="run") as progress, Workers(args.workers) as workers:
        model = JointResponseModel([logs[name] for name in fitted])
        delta = model.default_huber_delta
        fitter = Fitter.of(model, workers, delta, DEFAULT_SETTINGS, args.out / "fits")
        before: Fit | None = None
        by_hand = _models() if args.only != "loop" else {}
        for name, kinds in by_hand.items():
            before = _best_fit(fitter, kinds, before)
            table[name] = _row(before, runs)
            write_json(args.out / "result.json", table)
        if args.only != "by-hand":
            closed = close_loop(
                model,
                workers=workers,
                progress=progress,
                folder=args.out / "fits",
            )
            table["the loop"] = _row(closed.last, runs)
            table["verdict"] = closed.text
            write_json(args.out / "result.json", table)
            print(closed.text)
    columns = ("model", "objective", *(f"{name} [mrad]" for name in runs))
    rows = table_rows(table)
    print(markdown(columns, rows))
    title = "Mean absolute error of a servo's position in free runs"
    write_result(args.results, title, columns, rows, _NAME, arguments)
    return 0


def table_rows(table: Mapping[str, Any]) -> list[tuple[Cell, ...]]:
    """Returns a row for each model: name, objective, error of each group of runs."""
    return [
        (
            name,
            round(row["objective"], 2),
            *(round(1e3 * error, 1) for error in row["errors"].values()),
        )
        for name, row in table.items()
        if name != "verdict"
    ]


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_NAME}", __doc__, "")
    add_results_argument(parser)
    parser.add_argument("data", type=Path, help="folder of the servo's CSV files")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    parser.add_argument("--workers", type=int, default=1, help="processes (default 1)")
    parser.add_argument(
        "--only",
        choices=("by-hand", "loop"),
        help="the models made by hand, or the loop",
    )
    return parser.parse_args(arguments)


def _models() -> dict[str, tuple[type[Effect], ...]]:
    """Returns the kinds of friction of each model, beside the drive."""
    m1 = (RotorInertia, JointCoulombFriction, JointViscousFriction)
    m4 = (*m1, JointStribeckFriction, JointLoadFriction)
    return {
        "M1 Coulomb, viscous": m1,
        "M2 Stribeck": (*m1, JointStribeckFriction),
        "M3 load": (*m1, JointLoadFriction),
        "M4 Stribeck, load": m4,
        "M5 directional": (*m4, JointDirectionalFriction),
        "M6 quadratic": (*m4, JointDirectionalFriction, JointQuadraticFriction),
    }


def _best_fit(fitter: Fitter, kinds: Sequence[type[Effect]], before: Fit | None) -> Fit:
    """Returns the best of fits from the model before, and from rough values."""
    chosen = tuple(Candidate.of(kind(joint=_JOINT)) for kind in kinds)  # type: ignore[call-arg]
    fits = [fitter.fit(chosen, before)] if before else []
    for start in _STARTS:
        values = {
            f"{c.name}.{c.fields[0]}": start[type(c.effect)]
            for c in chosen
            if type(c.effect) in start
        }
        fits.append(fitter.fit(chosen, None, values=values))
    return min(fits, key=lambda fit: fit.objective)


def _row(fit: Fit, runs: Mapping[str, JointResponseModel]) -> dict[str, Any]:
    """Returns the objective, the errors of free runs [rad], and the values."""
    errors = {}
    for label, model in runs.items():
        run, _ = extended(model, fit.effects, with_shapes=True)
        error = run.predictions(fit.theta) - run.measurements.values
        errors[label] = float(np.mean(np.abs(error)))
    return {"objective": fit.objective, "errors": errors, "values": fit.values}


def _runs(
    logs: Mapping[str, Log], fitted: Sequence[str]
) -> dict[str, JointResponseModel]:
    """Returns models that simulate whole runs, by what they are."""
    others = [m for m in _MOTIONS if m not in _FITTED]
    groups = {
        "fitted": list(fitted),
        "other motions": [f"{m}_kp{gain}" for m in others for gain in (100, 200)],
        "gain 400": [f"{m}_kp400" for m in _MOTIONS],
    }
    return {
        label: JointResponseModel([logs[n] for n in names], segment=math.inf)
        for label, names in groups.items()
    }


def written_logs(data: Path, folder: Path) -> dict[str, Log]:
    """Returns the runs as logs of kind `joint_response`, written if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    urdf = folder / "pendulum.urdf"
    urdf.write_text(_URDF)
    names = [f"{motion}_kp{gain}" for motion in _MOTIONS for gain in (100, 200, 400)]
    for name in names:
        if not (folder / name).exists():
            _write(data / f"{name}.csv", folder / name, urdf)
    return {name: read_log(folder / name) for name in names}


def _write(source: Path, folder: Path, urdf: Path) -> None:
    with source.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    columns = {key: np.array([[float(row[key])] for row in rows]) for key in rows[0]}
    gain = _DUTY * float(source.stem.rpartition("kp")[2])
    header = LogHeader(
        "joint_response",
        source.stem,
        {"source": "github.com/Rhoban/bam, af22604"},
        joints=(_JOINT,),
        urdf=str(urdf),
        drive={"limit": 1.0},
    )
    table = {
        "time": columns["time"][:, 0],
        "q_commanded": columns["goal_position"],
        "q": columns["position"],
        "gain": np.full_like(columns["position"], gain),
        "supply": columns["input_volts"],
        "enabled": columns["torque_enable"],
    }
    with LogWriter(folder, header) as writer:
        writer.write_episode(flat_columns("joint_response", table))


if __name__ == "__main__":
    run(main)
