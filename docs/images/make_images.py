"""Takes the README's picture: Meshcat in the middle of an episode, in Chromium.

Run `python docs/images/make_images.py` with Debian's chromium installed.
"""

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeshcatView, start_meshcat

_STEPS = 45
BAR, _GAP = 24, 12  # pixels
_FLAGS = (
    "--headless --no-sandbox --disable-quic --no-first-run --disable-sync "
    "--disable-background-networking --disable-component-update "
    "--use-angle=swiftshader --enable-unsafe-swiftshader "
    "--window-size=1000,700 --virtual-time-budget=8000"
)


def main() -> None:
    """Writes overview.png beside this file: the cell, and a close-up of the lock."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{name}.png" for name in ("cell", "lock")]
        for file, close_up in zip(files, (False, True), strict=True):
            _take(file, close_up)
        _side_by_side(files, Path(__file__).with_name("overview.png"))


def _side_by_side(files: Sequence[Path], to: Path) -> None:
    """Joins pictures without the bar of Meshcat's controls at their top."""
    pictures = [Image.open(file).convert("RGB") for file in files]
    width, height = pictures[0].size
    left, right = (p.crop((0, BAR, width, height)) for p in pictures)
    joined = Image.new("RGB", (2 * width + _GAP, height - BAR), "white")
    joined.paste(left, (0, 0))
    joined.paste(right, (width + _GAP, 0))
    joined.save(to, optimize=True)


def _take(file: Path, close_up: bool) -> None:
    view = MeshcatView(start_meshcat(), close_up=close_up)
    simulation = TaskSimulation(
        load_scenario("removal_turned"), "cell", make_policy("admittance"), [view]
    )
    view.begin_episode()
    simulation.reset(0)
    for _ in range(_STEPS):
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
    main()
