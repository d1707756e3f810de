"""Takes the README's pictures: Meshcat in the middle of an episode, in Chromium.

Run `python docs/images/make_images.py` with Debian's chromium installed.
"""

import subprocess
import tempfile
from pathlib import Path

from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeshcatView, start_meshcat

_STEPS = 45
_FLAGS = (
    "--headless --no-sandbox --disable-quic --no-first-run --disable-sync "
    "--disable-background-networking --disable-component-update "
    "--use-angle=swiftshader --enable-unsafe-swiftshader "
    "--window-size=1000,700 --virtual-time-budget=8000"
)


def main() -> None:
    """Writes cell.png and lock.png beside this file."""
    for name, close_up in (("cell", False), ("lock", True)):
        _take(Path(__file__).with_name(f"{name}.png"), close_up)


def _take(file: Path, close_up: bool) -> None:
    view = MeshcatView(start_meshcat(), close_up=close_up)
    simulation = TaskSimulation(
        load_scenario("removal_turned"), "cell", make_policy("admittance"), [view]
    )
    view.begin_episode()
    simulation.reset(0)
    for _ in range(_STEPS):
        simulation.step()
    _screenshot(view.meshcat.web_url(), file)


def _screenshot(url: str, file: Path) -> None:
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
