"""How long one evaluation of the identification objective takes."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from drake_disasm.logs import read_log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.fitting.candidates import candidates, extended
from sysid.identification.linearisation import linearise
from sysid.models.twin import TwinModel
from sysid.objective import Objective
from sysid.parameters import nominal_values
from sysid.scenario_parameters import ParameterRequest, scenario_parameters
from sysid.workers import Workers

SIZES = (883, 1776)  # the thesis's, for which it gives about ten minutes
THESIS_S = 600.0
_SCENARIO = "removal_turned"
PARAMETERS = {
    "hydroelastic": ("contact.friction", "part.clearance", "GroovePose.ry"),
    "impact": tuple(
        f"contact.impact.{name}"
        for name in ("stiffness", "exponent", "damping", "depth")
    ),
}
_NOISE = 1.5e-4  # m, of exploration


@contextmanager
def recorded_log(transitions: int) -> Iterator[Path]:
    """Yields a temporary log of the twin with at least so many transitions."""
    scenario = load_scenario(_SCENARIO)
    policy = Exploring(make_policy("admittance"), _NOISE, 0)
    simulation = TaskSimulation(scenario, "twin", policy)
    with tempfile.TemporaryDirectory() as folder:
        yield record_transitions(Path(folder) / "log", simulation, transitions).folder


def evaluation_time(
    log: Path, transitions: int, workers: int, repeats: int, contact: str
) -> float:
    """Returns the median time [s] of an evaluation, with workers already started.

    Args:
        log: of transitions.
        transitions: how many of them.
        workers: processes.
        repeats: evaluations, each at other parameters.
        contact: the twin's `contact.model`.
    """
    scenario, parameters = scenario_parameters(
        load_scenario(_SCENARIO, [f"contact.model={contact}"]),
        [ParameterRequest(name) for name in PARAMETERS[contact]],
    )
    model = TwinModel([read_log(log)], scenario, parameters).first(transitions)
    theta = nominal_values(parameters)
    with Workers(workers) as pool:
        objective = Objective(model, pool)
        objective(theta)
        times = []
        for i in range(1, repeats + 1):
            start = time.perf_counter()
            objective(theta * (1.0 + 1e-3 * i))  # as in a search: no two are the same
            times.append(time.perf_counter() - start)
    return float(np.median(times))


def jacobian_times(
    log: Path, transitions: int, workers: int
) -> tuple[float, float, int]:
    """Returns the times [s] of an evaluation and of all candidates' derivatives.

    And for how many amplitudes of candidates the twin with IMPACT has to be simulated.

    Args:
        log: of transitions.
        transitions: how many of them.
        workers: processes.
    """
    scenario = load_scenario(_SCENARIO, ["contact.model=impact"])
    model = TwinModel([read_log(log)], scenario, ()).first(transitions)
    whole, _ = extended(model, candidates(model))
    with Workers(workers) as pool:
        objective = Objective(whole, pool)
        u = objective.start
        linearise(Objective(model.first(20), pool), np.zeros(0))  # starts the workers
        start = time.perf_counter()
        residual = objective.residuals(objective.scaling.from_unit(u))[0]
        one = time.perf_counter() - start
        linearise(objective, u, central=False, residual=residual)
        both = time.perf_counter() - start
    return one, both - one, int(whole.simulated.sum())


def cores() -> int:
    """Returns how many cores there are."""
    return os.cpu_count() or 1
