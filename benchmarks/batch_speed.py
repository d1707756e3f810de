"""How many steps of the task per second the twin makes, one at a time and in batches.

All make the same moves: those of the policy `admittance` in the turned groove, where
the bolt is in contact nearly all the time.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from drake_disasm.common.arrays import to_numpy
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.simulation import TaskSimulation
from drake_disasm.twin.batch import BatchedTwin

SIZES = (1, 16, 256, 4096)
#: Where a batch computes, and on how many threads, by what a key says.
KINDS = {
    "numpy": ("numpy", 1),
    "numpy_two": ("numpy", 2),
    "torch": ("cpu", 1),
    "cuda": ("cuda", 1),
}
#: All batches that are measured: kinds and how many environments.
BATCHES = [
    *((kind, count) for kind in KINDS if kind != "cuda" for count in SIZES),
    *(("cuda", count) for count in (256, 4096, 65536, 262144)),
]
CONTACTS = ("hydroelastic", "impact")
_SCENARIO, _POLICY = "removal_turned", "admittance"
_MOVES = 40  # of an episode
_SECONDS = 5.0  # at most so long, but for one step


def scenario_with(contact: str) -> Scenario:
    """Returns the scenario with a model of contact."""
    return load_scenario(_SCENARIO, [f"contact.model={contact}"])


def diagram_speed(contact: str) -> tuple[float, np.ndarray]:
    """Returns steps per second of the diagram's twin, and its moves (steps, 6)."""
    simulation = TaskSimulation(scenario_with(contact), "twin", make_policy(_POLICY))
    simulation.reset(0)
    moves: list[np.ndarray] = []
    start = time.perf_counter()
    while len(moves) < _MOVES:
        outcome = simulation.step().outcome
        moves.append(simulation.action())
        if outcome is not Outcome.RUNNING:
            break
    return len(moves) / (time.perf_counter() - start), np.array(moves)


def batch_speed(count: int, kind: str, moves: np.ndarray) -> float:
    """Returns steps per second of all environments of a batch together.

    Args:
        count: of environments.
        kind: one of KINDS.
        moves: (steps, 6) that each of them makes.
    """
    import torch

    device, threads = KINDS[kind]
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        twin = BatchedTwin(scenario_with("impact"), count, device, threads)
        twin.reset(range(count))
        twin.step(moves[:1].repeat(count, axis=0))  # compiles what a GPU runs
        twin.reset(range(count))
        return _steps_per_s(twin, moves)
    finally:
        torch.set_num_threads(before)


def command(count: int) -> list[str]:
    """Returns the command of a process that makes some steps of a batch in NumPy."""
    work = (
        f"import batch_speed; t = batch_speed.BatchedTwin(batch_speed.scenario_with("
        f"'impact'), {count}, 'numpy'); t.reset(range({count})); "
        f"[t.step(batch_speed.np.zeros(({count}, 6))) for _ in range(3)]"
    )
    path = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); "
    return [sys.executable, "-c", path + work]


def _steps_per_s(twin: BatchedTwin, moves: np.ndarray) -> float:
    done, start = 0, time.perf_counter()
    for move in moves:
        twin.step(np.tile(move, (twin.count, 1)))
        done += 1
        if time.perf_counter() - start > _SECONDS:
            break
    to_numpy(twin.reading)  # a GPU has finished only now
    return twin.count * done / (time.perf_counter() - start)


def speeds() -> Iterator[tuple[str, float, float]]:
    """Yields keys, steps per second, and the ratio to the IMPACT diagram's.

    Of batches on a GPU only where there is one.
    """
    import torch

    hydroelastic, _ = diagram_speed("hydroelastic")
    impact, moves = diagram_speed("impact")
    yield "diagram_hydroelastic_steps_per_s", hydroelastic, hydroelastic / impact
    yield "diagram_impact_steps_per_s", impact, 1.0
    for kind, count in BATCHES:
        if kind != "cuda" or torch.cuda.is_available():
            found = batch_speed(count, kind, moves)
            yield f"batch_{kind}_{count}_steps_per_s", found, found / impact
