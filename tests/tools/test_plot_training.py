"""tools/plot_training.py."""

import subprocess
from pathlib import Path

from drake_disasm.learning.run import write_episodes
from drake_disasm.mdp import Outcome
from drake_disasm.task.episode import EpisodeSummary
from tests.tools.programs import run_program


def _plot(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return run_program("plot_training", *arguments, cwd=folder)


def test_several_trainings_become_one_figure(tmp_path: Path) -> None:
    for name in ("a", "b"):
        for seed in range(3):
            folder = tmp_path / name / f"seed_{seed:03d}"
            folder.mkdir(parents=True)
            episodes = [
                EpisodeSummary(
                    seed=i,
                    reward_terms={"progress": float(i * seed)},
                    outcome=Outcome.SUCCESS if i > 5 else Outcome.FORCE_LIMIT,
                )
                for i in range(12)
            ]
            write_episodes(folder / "episodes.csv", episodes)
    done = _plot(tmp_path, "first=a", "b", "--out", "figures/both.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "figures/both.png").read_bytes().startswith(b"\x89PNG")


def test_a_folder_without_trainings_is_named(tmp_path: Path) -> None:
    done = _plot(tmp_path, "nowhere", "--out", "x.png")
    assert done.returncode == 2 and "nowhere: no seed_*/episodes.csv" in done.stderr
