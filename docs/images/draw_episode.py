"""Draws an episode of a learned policy beside `admittance`, and takes its picture.

Run `python docs/images/draw_episode.py` with Debian's chromium installed: writes
episode.png, two Meshcat pictures above the bolt's way and the force on it.
"""

import sys
import tempfile
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")
from make_images import BAR, screenshot
from matplotlib import pyplot
from matplotlib.axes import Axes
from PIL import Image

from drake_disasm.mdp import Outcome
from drake_disasm.policies import find_policy, load_policy, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.systems.policy import Policy
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeshcatView, start_meshcat

LEARNED, _SCENARIO, _SEED = "removal_randomised", "removal_turned", 1000


def run(
    name: str,
    scenario: Scenario,
    picture_at: int | None = None,
    file: Path | None = None,
) -> NDArray[np.float64]:
    """Returns the observations (n, 12) of an episode in the cell.

    Args:
        name: of the policy.
        scenario: of the cell.
        picture_at: step after which Meshcat's picture is taken; None takes none.
        file: of the picture.
    """
    policy: Policy = make_policy("admittance", scenario)
    if name != "admittance":
        policy = load_policy(find_policy(name))
    view = MeshcatView(start_meshcat(), close_up=True) if file else None
    simulation = TaskSimulation(scenario, "cell", policy, [view] if view else [])
    if view:
        view.begin_episode()
    simulation.reset(_SEED)
    rows = []
    while True:
        result = simulation.step()
        rows.append(result.observation)
        if view and file and len(rows) == picture_at:
            screenshot(view.meshcat.web_url(), file)
            break
        if result.outcome is not Outcome.RUNNING:
            break
    return np.array(rows)


def main(out: Path) -> None:
    """Writes the picture."""
    scenario = load_scenario(_SCENARIO)
    found = {name: run(name, scenario) for name in (LEARNED, "admittance")}
    lift = int(np.argmax(found[LEARNED][:, 1] > 2.5e-3)) + 1
    figure = pyplot.figure(figsize=(9, 6.6), layout="constrained")
    panels = figure.subplot_mosaic(
        [["before", "lifting"], ["way", "way"], ["force", "force"]],
        height_ratios=[2.2, 1, 1],
    )
    with tempfile.TemporaryDirectory() as folder:
        for panel, step in (("before", 30), ("lifting", lift)):
            file = Path(folder) / f"{panel}.png"
            run(LEARNED, scenario, step, file)
            picture = np.asarray(Image.open(file).convert("RGB"))[BAR:]
            panels[panel].imshow(picture)
            panels[panel].set(title=f"{LEARNED}, step {step}")
            panels[panel].axis("off")
    draw_way_and_force(panels, found)
    figure.savefig(out, dpi=110)


def draw_way_and_force(
    panels: dict[str, Axes], found: dict[str, NDArray[np.float64]]
) -> None:
    """Draws the bolt's way and the force on it.

    Args:
        panels: named way and force.
        found: observations (n, 12) by policy, the learned one first.
    """
    for (name, states), colour in zip(
        found.items(), ("tab:red", "tab:gray"), strict=True
    ):
        x, y = 1e3 * states[:, :2].T
        steps = np.arange(1, len(x) + 1)
        panels["way"].plot(steps, x, color=colour, label=f"{name}: x, along the groove")
        panels["way"].plot(steps, y, "--", color=colour, label=f"{name}: y, out of it")
        force = np.linalg.norm(states[:, 6:9], axis=1)
        panels["force"].plot(steps, force, color=colour, label=name)
    panels["way"].set(ylabel="bolt [mm]")
    panels["force"].set(xlabel="step (0.1 s)", ylabel="force on the bolt [N]")
    for panel in ("way", "force"):
        panels[panel].legend(fontsize="small")
        panels[panel].grid(alpha=0.3)


if __name__ == "__main__":
    here = Path(__file__).with_name("episode.png")
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else here)
