"""The page that people look at, in a headless browser."""

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.visualization import MeshcatView, start_meshcat
from tests.tools.programs import Runner

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here: apt-get install chromium"
)
FLAGS = (
    "--headless --no-sandbox --disable-quic --no-first-run --disable-sync "
    "--disable-background-networking --disable-component-update "
    "--use-angle=swiftshader --enable-unsafe-swiftshader "
    "--window-size=900,600 --virtual-time-budget=8000"
)


def _chromium(action: str, url: str, folder: Path) -> str:
    """Loads a page and returns what the action prints."""
    profile = f"--user-data-dir={folder / 'profile'}"
    return subprocess.run(
        [str(CHROMIUM), *FLAGS.split(), profile, action, url],
        check=True,
        capture_output=True,
        text=True,
    ).stdout


def _screenshot(url: str, folder: Path) -> np.ndarray:
    """Returns the page's pixels (h, w, 3) in 0 ... 1."""
    file = folder / "page.png"
    _chromium(f"--screenshot={file}", url, folder)
    return imread(file)[..., :3]


def _assert_shows_robot_and_lock(page: np.ndarray) -> None:
    """The arm's orange covers, its white links, the brass groove are in the picture."""
    r, g, b = page[..., 0], page[..., 1], page[..., 2]
    orange = (r > 0.9) & (g > 0.5) & (g < 0.8) & (b < 0.5)
    brass = (r > 0.6) & (g > 0.45) & (b < 0.45) & (r - g < 0.25) & ~orange
    dark = page.max(axis=-1) < 0.2
    assert orange.sum() > 400
    assert brass.sum() > 60
    assert dark.sum() > 1500  # gripper, sensor, rings


@pytest.fixture
def live_page() -> Iterator[str]:
    """The address of a page in the middle of an episode."""
    view = MeshcatView(start_meshcat())
    simulation = TaskSimulation(
        load_scenario("removal"), "cell", make_policy("admittance"), [view]
    )
    view.begin_episode()
    simulation.reset(0)
    for _ in range(40):
        simulation.step()
    yield view.meshcat.web_url()


def test_live_page_shows_robot_and_lock(live_page: str, tmp_path: Path) -> None:
    assert live_page.startswith("http://localhost:")  # loopback alone
    _assert_shows_robot_and_lock(_screenshot(live_page, tmp_path))


def test_saved_page_plays_offline(simulate: Runner, tmp_path: Path) -> None:
    done = simulate("--html", "page.html", "--set", "task.steps=20")
    assert done.returncode == 0, done.stderr
    url = (tmp_path / "page.html").as_uri()
    # Meshcat's controls list a recording only once it is loaded.
    controls = _chromium("--dump-dom", url, tmp_path)
    assert re.search('title">Animations</li>.*title">default</li>', controls)
    _assert_shows_robot_and_lock(_screenshot(url, tmp_path))
