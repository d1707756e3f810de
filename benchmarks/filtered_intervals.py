"""Whether intervals of friction hold the truth in logs that the import has filtered.

    python benchmarks/filtered_intervals.py --seeds 40

Simulates an arm of three joints at 500 Hz with dry, viscous and load friction, rotors
and white torque noise, writes each recording as CSV, imports it, and fits all effects
by least squares: with the filter that the log's provenance states, and without.
"""

import argparse
import dataclasses
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from results import Cell, add_results_argument, markdown, significant, write_result
from tqdm import tqdm

from drake_disasm.common import options
from drake_disasm.common.program import argument_parser, run
from drake_disasm.effects import (
    ArmSamples,
    ArmTorqueEffect,
    JointCoulombFriction,
    JointLoadFriction,
    JointViscousFriction,
    RotorInertia,
)
from drake_disasm.effects.fields import amplitudes
from drake_disasm.logs import Log, read_log
from drake_disasm.logs.importing import (
    ImportProcessing,
    Known,
    guessed_map,
    import_recordings,
    read_source,
    write_log,
)
from sysid.identification.linearisation import Linearisation, linearise
from sysid.identification.uncertainty import uncertainty
from sysid.models.effects import effect_parameter
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import ArmRegressor
from sysid.objective import Objective
from sysid.parameters import Parameter

Array = NDArray[np.float64]

_NAME = "benchmarks/filtered_intervals.py"
JOINTS = ("base", "shoulder", "elbow")
_PERIOD, _SECONDS = 0.002, 20.0
_HARMONICS = (0.1, 0.2, 0.3, 0.5)  # Hz
_SWING = 1.0  # rad/s, of all harmonics together
_QUANTUM = 1e-5  # rad, of an encoder
_NOISE = 0.5  # N m, white
#: The first joints' rotors are part of base parameters.
EFFECTS: tuple[ArmTorqueEffect, ...] = (
    *map(JointCoulombFriction, JOINTS, (8.0, 6.0, 3.0)),
    *map(JointViscousFriction, JOINTS, (10.0, 8.0, 4.0)),
    *map(JointLoadFriction, JOINTS[1:], (0.08, 0.1)),
    RotorInertia(JOINTS[2], 0.5),
)
#: What is imported how: with the import's own cut-off, and a lower one [Hz].
_CUTOFFS: tuple[float | None, ...] = (None, 6.0, 3.0)
_COLUMNS = (
    "cut-off",
    "filter modelled",
    "largest bias [%]",
    "largest bias [standard errors]",
    "rms error [standard errors]",
    "intervals with the truth",
    "of",
    "share [%]",
)
_NOTE = (
    "Bias: the mean over all logs, of the effect where it is largest. Intervals: 95 %, "
    "by a block bootstrap. A right error has an rms of one standard error."
)
_LINK = """<link name="link_{i}"><inertial><origin xyz="0.02 0.01 {half}"/>
<mass value="{mass}"/><inertia ixx="{big}" ixy="0" ixz="0" iyy="{big}" iyz="0"
izz="{small}"/></inertial></link><joint name="{joint}" type="revolute">
<parent link="{parent}"/><child link="link_{i}"/><origin xyz="0 0 {height}"/>
<axis xyz="{axis}"/><limit lower="-9" upper="9" velocity="9" effort="999"/></joint>"""
_SIZES = ((8.0, 0.15, "0 0 1"), (6.0, 0.4, "0 1 0"), (3.0, 0.4, "0 1 0"))


@dataclasses.dataclass(frozen=True)
class Errors:
    """Estimates of all effects' amplitudes in one log.

    Attributes:
        error: (k,) estimate minus truth, over the bootstrap's standard error.
        share: (k,) estimate minus truth, over the truth.
        inside: (k,) whether the bootstrap's 95 % interval holds the truth.
    """

    error: Array
    share: Array
    inside: NDArray[np.bool_]


def write_arm(path: Path) -> Path:
    """Writes the URDF of an arm of three joints."""
    parts, parent, height = [], "world_link", 0.0
    for i, (mass, length, axis) in enumerate(_SIZES):
        big = mass * length**2 / 12.0
        parts.append(
            _LINK.format(
                i=i, half=length / 2.0, mass=mass, big=big, small=0.2 * big,
                joint=JOINTS[i], parent=parent, height=height, axis=axis,
            )
        )  # fmt: skip
        parent, height = f"link_{i}", length
    links = "\n".join(parts)
    path.write_text(f'<robot name="arm"><link name="world_link"/>{links}</robot>')
    return path


def recording(
    urdf: Path, seed: int, period: float = _PERIOD
) -> tuple[Array, Array, Array]:
    """Returns times (n,), and positions and torques (n, joints), as measured.

    Args:
        urdf: of the arm.
        seed: of the motion and the noise.
        period: between rows [s].
    """
    random = np.random.default_rng(seed)
    time: Array = period * np.arange(float(round(_SECONDS / period)))
    q, v, vd = _fourier(random, time)
    load = ArmRegressor(str(urdf), JOINTS).torques(q, v, vd)
    samples = ArmSamples(JOINTS, q, v, vd, load)
    tau = load + sum(effect.torques(samples) for effect in EFFECTS)
    tau += _NOISE * random.standard_normal(tau.shape)
    return time, np.round(q / _QUANTUM) * _QUANTUM, tau


def record(path: Path, urdf: Path, seed: int) -> Path:
    """Writes a recording of positions and torques as CSV.

    Args:
        path: of the table.
        urdf: of the arm.
        seed: of the motion and the noise.
    """
    time, q, tau = recording(urdf, seed)
    names = [f"{name}.{i}" for name in ("q", "tau") for i in range(len(JOINTS))]
    table = np.column_stack([time, q, tau])
    header = ",".join(["time", *names])
    np.savetxt(path, table, "%.9g", ",", header=header, comments="")
    return path


def _fourier(random: np.random.Generator, time: Array) -> tuple[Array, Array, Array]:
    """Returns q, v, vd (n, joints) of a few harmonics."""
    q, v, vd = np.zeros((3, len(time), len(JOINTS)))
    for about in _HARMONICS:
        omega = 2.0 * np.pi * about * random.uniform(0.8, 1.2)
        speed = random.normal(0.0, 0.5 * _SWING, len(JOINTS))
        phase = omega * time[:, None] + random.uniform(0.0, 2.0 * np.pi, len(JOINTS))
        q += speed / omega * np.sin(phase)
        v += speed * np.cos(phase)
        vd -= speed * omega * np.sin(phase)
    return q, v, vd


def imported(table: Path, urdf: Path, folder: Path, cutoff: float | None) -> Log:
    """Returns the log that the import makes of a recording.

    Args:
        table: the recording, or a bag.
        urdf: of the arm.
        folder: of the log.
        cutoff: of the filter [Hz]; None for the import's own.
    """
    source = read_source(table)
    fields = guessed_map(source, "joint_motion", Known(JOINTS, urdf=str(urdf)))
    found = import_recordings([source], fields, ImportProcessing(cutoff))
    write_log(found, [source], fields, folder, {})
    return read_log(folder)


def without_provenance(log: Log) -> Log:
    """Returns a log that does not say what filter acted on it."""
    header = dataclasses.replace(log.header, provenance={})
    return dataclasses.replace(log, header=header)


def fitted(log: Log) -> tuple[Linearisation, list[Parameter]]:
    """Returns the linearisation at the least squares, and the effects' parameters.

    Fitted are base parameters and the amplitudes of the true effects.
    """
    bare = JointMotionModel([log])
    effects = [
        dataclasses.replace(effect, **{_field(effect): 0.0}) for effect in EFFECTS
    ]
    fields = [_field(effect) for effect in effects]
    added = [effect_parameter(effects, i, name) for i, name in enumerate(fields)]
    noise = np.ones(len(JOINTS))
    measured = bare.measurements.with_noise(noise, "the same at all joints")
    objective = Objective(bare.with_measurements(measured).with_effects(effects, added))
    at = linearise(objective, objective.start, central=False)
    step = np.linalg.lstsq(at.flat_jacobian, -at.residual.reshape(-1), rcond=None)[0]
    residual = at.residual + at.jacobian @ step
    return dataclasses.replace(at, u=at.u + step, residual=residual), added


def _field(effect: ArmTorqueEffect) -> str:
    return amplitudes(type(effect))[0]


def errors(log: Log) -> Errors:
    """Returns how far estimates of all effects are from the truth."""
    at, parameters = fitted(log)
    spread = uncertainty(at, np.zeros(len(at.residual), dtype=np.int64))
    own = slice(-len(EFFECTS), None)
    scale = np.array([p.high - p.low for p in parameters])
    estimate = np.array([p.low for p in parameters]) + scale * at.u[own]
    truth = np.array([getattr(effect, _field(effect)) for effect in EFFECTS])
    error = scale * np.sqrt(np.diagonal(spread.bootstrap_covariance)[own])
    low, high = scale * spread.bootstrap[own].T
    off = estimate - truth
    return Errors(off / error, off / truth, (off + low <= 0.0) & (off + high >= 0.0))


def one_seed(seed: int, folder: Path) -> list[Errors]:
    """Returns errors for each cut-off, without and with the filter modelled."""
    urdf = write_arm(folder / "arm.urdf")
    table = record(folder / "run.csv", urdf, seed)
    found = []
    for number, cutoff in enumerate(_CUTOFFS):
        log = imported(table, urdf, folder / f"log_{number}", cutoff)
        found += [errors(without_provenance(log)), errors(log)]
    return found


def summary(found: Sequence[Sequence[Errors]]) -> list[list[Cell]]:
    """Returns the rows of the table.

    Args:
        found: of each seed, what `one_seed` gives.
    """
    rows: list[list[Cell]] = []
    for number, of_all in enumerate(zip(*found, strict=True)):
        cutoff, is_modelled = _CUTOFFS[number // 2], bool(number % 2)
        error, share, inside = (
            np.array([getattr(each, name) for each in of_all])
            for name in ("error", "share", "inside")
        )
        rows.append(
            [
                "chosen by the import" if cutoff is None else f"{cutoff:g} Hz",
                "yes" if is_modelled else "no",
                significant(100.0 * float(np.abs(share.mean(axis=0)).max()), 2),
                significant(float(np.abs(error.mean(axis=0)).max()), 2),
                significant(float(np.sqrt(np.mean(error**2))), 3),
                int(inside.sum()),
                inside.size,
                significant(100.0 * float(inside.mean()), 3),
            ]
        )
    return rows


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_NAME}", __doc__, "")
    parser.add_argument(
        "--seeds",
        type=options.positive,
        default=40,
        metavar="N",
        help="recordings, each with its own motion and noise (default: 40)",
    )
    add_results_argument(parser)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    found = []
    for seed in tqdm(range(args.seeds), unit="log", leave=False):
        with tempfile.TemporaryDirectory() as folder:
            found.append(one_seed(seed, Path(folder)))
    rows = summary(found)
    print(markdown(_COLUMNS, rows))
    title = "Intervals of friction and rotors in filtered logs"
    write_result(args.results, title, _COLUMNS, rows, _NAME, arguments, _NOTE)
    return 0


if __name__ == "__main__":
    run(main)
