"""benchmarks/benchmark.py: its keys and its files, not its figures."""

import json
import math
from pathlib import Path

import benchmark
import pytest

from tests.refusals import refusal

TWIN = ["twin_reset_ms", "twin_steps_per_s", "twin_python_share"]
OBJECTIVE = ["objective_883_s", "objective_1776_s", "objective_883_one_core_s"]


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (["policy_inference_us"], "the network in torch"),
        pytest.param(TWIN, "twin_reset_ms", marks=pytest.mark.slow),
        pytest.param(OBJECTIVE, "the thesis's 10 minutes", marks=pytest.mark.slow),
    ],
)
def test_only_and_json(keys, words: str, tmp_path: Path, capsys) -> None:
    file = tmp_path / "figures.json"
    assert benchmark.main(["--only", *keys, "--json", str(file)]) == 0
    figures, printed = json.loads(file.read_text()), capsys.readouterr().out
    assert set(figures) == set(keys)
    assert words in printed and all(key in printed for key in keys)
    # From below there is no bound: on a busy machine a share of times can be negative.
    assert -math.inf < figures.pop("twin_python_share", 0.0) < 1.0
    assert all(figure > 0.0 for figure in figures.values())


def test_unknown_key_is_refused() -> None:
    message = refusal(benchmark.main, ["--only", "twin_reset"])
    assert "--only twin_reset: no such figure" in message and "twin_reset_ms" in message
