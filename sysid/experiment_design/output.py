"""A designed motion as files: a table to be played, its data, and a picture."""

import csv
import dataclasses
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.files import make_folder, write_figure, write_json, write_text
from drake_disasm.free_motion.arm_limits import JointLimits
from sysid.experiment_design.design import Design
from sysid.experiment_design.information import ArmExperiment

TABLE, DATA, PICTURE = "motion.csv", "design.json", "motion.png"


def write_design(
    design: Design,
    experiment: ArmExperiment,
    limits: JointLimits,
    rate: float,
    folder: Path,
    provenance: dict[str, Any],
) -> None:
    """Writes a design into a folder.

    Args:
        design: to write.
        experiment: for which it was made.
        limits: of the joints.
        rate: rows of the table [Hz].
        folder: made if need be.
        provenance: command, date, versions, commit.
    """
    make_folder(folder)
    write_text(folder / TABLE, _table(design, rate))
    write_json(folder / DATA, _data(design, experiment) | {"provenance": provenance})
    _draw(design, limits, folder / PICTURE)


def _table(design: Design, rate: float) -> str:
    """Returns time, q, v and vd of one period; joints counted from 0, SI."""
    time = np.arange(round(design.motion.duration * rate) + 1) / rate
    states = design.motion.states(time)
    joints = range(len(design.motion.centre))
    names = [f"{kind}.{i}" for kind in ("q", "v", "vd") for i in joints]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time", *names])
    for row in np.column_stack([time, *states]):
        writer.writerow([f"{value:.9g}" for value in row])
    return stream.getvalue()


def _data(design: Design, experiment: ArmExperiment) -> dict[str, Any]:
    motion = design.motion
    return {
        "joints": list(experiment.joints),
        "duration": motion.duration,
        "centre": motion.centre.tolist(),
        "a": motion.a.tolist(),
        "b": motion.b.tolist(),
        "random": dataclasses.asdict(design.before),
        "designed": dataclasses.asdict(design.after),
        "used": {name: share.tolist() for name, share in design.used.items()},
        "clearance": design.clearance,
        "height": design.height,
        "predicted": [
            {"name": u.name, "unit": u.unit, "value": u.value, "half_width": float(s)}
            for u, s in zip(experiment.unknowns, design.spreads, strict=True)
        ],
    }


def _draw(design: Design, limits: JointLimits, path: Path) -> None:
    """Draws positions and velocities as shares of what the limits allow."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    time = np.linspace(0.0, design.motion.duration, 1000)
    q, v, _ = design.motion.states(time)
    middle = 0.5 * (limits.upper + limits.lower)
    half = 0.5 * (limits.upper - limits.lower)
    figure, axes = pyplot.subplots(2, 1, figsize=(9, 5), sharex=True)
    for axis, values, label in (
        (axes[0], (q - middle) / half, "position / limit"),
        (axes[1], v / limits.velocity, "velocity / limit"),
    ):
        for name, column in zip(limits.names, values.T, strict=True):
            axis.plot(time, column, label=name)
        axis.set(ylabel=label, ylim=(-1.1, 1.1))
        axis.grid(alpha=0.3)
    axes[1].set(xlabel="time [s]")
    axes[0].legend(fontsize="small", ncols=4, loc="upper center")
    figure.tight_layout()
    write_figure(path, figure)
    pyplot.close(figure)


def summary(design: Design, experiment: ArmExperiment) -> Iterator[str]:
    """Yields what was designed in lines."""
    before, after = design.before, design.after
    yield (
        f"criterion {experiment.criterion_name}: {after.criterion:.4g}, condition "
        f"number {after.condition:.3g}; the median random motion: "
        f"{before.criterion:.4g} and {before.condition:.3g}, its intervals about "
        f"{np.exp(0.5 * (before.criterion - after.criterion)):.3g} times as wide"
    )
    for name, share in design.used.items():
        each = ", ".join(f"{100.0 * s:.0f}" for s in share)
        yield f"{name}: {each} % of what the limits leave"
    yield (
        f"least clearance of links {1e3 * design.clearance:.3g} mm, lowest link "
        f"{design.height:.3g} m over the base's frame"
    )
    base = [
        (u, s)
        for u, s in zip(experiment.unknowns, design.spreads, strict=True)
        if u.value
    ]
    known = sum(abs(u.value) > s for u, s in base)
    yield f"base parameters not zero: {known} of {len(base)} would be told from zero"
    for u, s in zip(experiment.unknowns, design.spreads, strict=True):
        if u.is_effect:
            yield f"{u.name}: 95 % interval of ± {s:.3g} {u.unit}"
