"""A picture of an import: where the cut-off is, and what the filter does."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.files import write_figure
from drake_disasm.logs.importing.importer import Imported

_SHOWN = 2.0  # s


def plot_import(imported: Imported, path: Path) -> None:
    """Draws the spectrum with the cut-off, and a stretch before and after the filter.

    The spectrum is that of each joint's acceleration; the stretch is the first joint's.

    Args:
        imported: joint motion.
        path: of the PNG.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    done = imported.done
    assert done is not None
    figure, axes = pyplot.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
    for own in done.spectra[0]:
        label = f"joint {own.joint}"
        axes[0].loglog(own.frequency, np.sqrt(own.density), label=label)
    if math.isfinite(done.cutoff):
        axes[0].axvline(done.cutoff, color="black", linestyle="--", label="cut-off")
    axes[0].set(xlabel="frequency [Hz]", ylabel="acceleration [SI / √Hz]")
    axes[0].set_title("Spectrum of the acceleration", fontsize="medium")
    axes[0].legend(fontsize="small")
    _draw_stretch(axes[1], imported)
    write_figure(path, figure)
    pyplot.close(figure)


def _draw_stretch(axis: Any, imported: Imported) -> None:
    name = next(n for n in ("tau", "current", "q") if n in imported.episodes[0])
    recording, done = imported.recordings[0], imported.done
    assert done is not None
    episode = imported.episodes[0]
    begin = recording.time[0] + done.reach * done.clocks[0].period
    time = recording.time - begin
    rows = (time >= 0) & (time <= _SHOWN)
    own = episode["time"] <= _SHOWN
    axis.plot(time[rows], recording.columns[name][rows, 0], alpha=0.4, label="recorded")
    axis.plot(episode["time"][own], episode[name][own, 0], label="in the log")
    axis.set(xlabel="time [s]", ylabel=f"{name}.0")
    axis.set_title("As recorded and as filtered", fontsize="medium")
    axis.legend(fontsize="small")
