"""Takes pictures of Meshcat in the middle of episodes, in Chromium.

Run `python docs/images/make_images.py [PICTURE ...]` with Debian's chromium installed.
"""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeshcatView, start_meshcat

#: By file: the scenario, and how many steps of its baseline.
PICTURES = {
    "overview": ("removal_turned", 45),
    "ur5e_peg": ("ur5e_peg", 15),
    "panda_bayonet": ("panda_bayonet", 60),
}
BAR, _GAP = 24, 12  # pixels
_FLAGS = (
    "--headless --no-sandbox --disable-quic --no-first-run --disable-sync "
    "--disable-background-networking --disable-component-update "
    "--use-angle=swiftshader --enable-unsafe-swiftshader "
    "--window-size=1000,700 --virtual-time-budget=8000"
)


def main(names: Sequence[str]) -> None:
    """Writes pictures beside this file: the cell, and a close-up of the part."""
    for name in names or PICTURES:
        with tempfile.TemporaryDirectory() as folder:
            files = [Path(folder) / f"{view}.png" for view in ("cell", "part")]
            for file, close_up in zip(files, (False, True), strict=True):
                _take(file, close_up, *PICTURES[name])
            _side_by_side(files, Path(__file__).with_name(f"{name}.png"))


def _side_by_side(files: Sequence[Path], to: Path) -> None:
    """Joins pictures without the bar of Meshcat's controls at their top."""
    pictures = [Image.open(file).convert("RGB") for file in files]
    width, height = pictures[0].size
    left, right = (p.crop((0, BAR, width, height)) for p in pictures)
    joined = Image.new("RGB", (2 * width + _GAP, height - BAR), "white")
    joined.paste(left, (0, 0))
    joined.paste(right, (width + _GAP, 0))
    joined.save(to, optimize=True)


def _take(file: Path, close_up: bool, name: str, steps: int) -> None:
    view = MeshcatView(start_meshcat(), close_up=close_up)
    scenario = load_scenario(name)
    policy = make_policy("admittance", scenario)
    simulation = TaskSimulation(scenario, "cell", policy, [view])
    view.begin_episode()
    simulation.reset(0)
    for _ in range(steps):
        simulation.step()
    screenshot(view.meshcat.web_url(), file)


def screenshot(url: str, file: Path) -> None:
    """Takes a picture of a page."""
    with tempfile.TemporaryDirectory() as profile:
        subprocess.run(
            [
                "chromium",
                *_FLAGS.split(),
                f"--user-data-dir={profile}",
                f"--screenshot={file}",
                url,
            ],
            check=True,
            capture_output=True,
        )


if __name__ == "__main__":
    main(sys.argv[1:])
