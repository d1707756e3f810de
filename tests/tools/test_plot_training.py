"""plot-training: one figure of several trainings."""

from pathlib import Path

from tests.tools.inputs import write_trainings
from tests.tools.programs import assert_one_line, run_program


def test_several_trainings_become_one_figure(tmp_path: Path) -> None:
    write_trainings(tmp_path / "a", tmp_path / "b")
    trainings = ("first=a", "b", "--out", "figures/both.png")
    done = run_program("plot-training", *trainings, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "figures/both.png").read_bytes().startswith(b"\x89PNG")
    done = run_program("plot-training", "nowhere", "--out", "x.png", cwd=tmp_path)
    assert_one_line(done, ["nowhere", "seed_*/episodes.csv"])
