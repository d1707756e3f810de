"""Draws an episode of the policy `sliding` beside `admittance`, in the cell.

Run `python docs/images/draw_sliding.py`: writes sliding.png, the bolt's way and the
force on it in a groove that is turned by four degrees.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from draw_episode import draw_way_and_force, run
from matplotlib import pyplot

from drake_disasm.scenario import load_scenario

_SETTINGS = ["effects=[!GroovePose {ry: 0.0698}]"]  # rad, 4 degrees


def main(out: Path) -> None:
    """Writes the picture."""
    scenario = load_scenario("chapter3", _SETTINGS)
    found = {name: run(name, scenario) for name in ("sliding", "admittance")}
    figure = pyplot.figure(figsize=(9, 4.4), layout="constrained")
    panels = figure.subplot_mosaic([["way"], ["force"]])
    draw_way_and_force(panels, found)
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    here = Path(__file__).with_name("sliding.png")
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else here)
