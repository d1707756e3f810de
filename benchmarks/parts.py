"""Parts against statics and against themselves refined.

    python benchmarks/parts.py play
    python benchmarks/parts.py jamming
    python benchmarks/parts.py learning out/peg.json out/bayonet.json

play: how far a peg moves across its hole under 1 N. jamming: how far a peg comes in
0.2 s that is pulled beside its axis, against Whitney's jamming diagram ("Quasi-static
assembly of compliantly supported rigid parts", 1982): without a side force it slides
while M / F < l / (2 mu), for two contacts that are l apart. detent: the torque that a
bayonet's sensor reads against its spring's. time_steps: peaks of the baseline's
episodes at half the time step. contact: its episodes with hydroelastic contact and with
IMPACT. speed: times real time. learning: policies as `drake-disasm evaluate --json` has
found them, the seeds of a training together.
"""

import argparse
import dataclasses
import itertools
import json
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from results import Cell, add_results_argument, markdown, write_result

from drake_disasm.cell.lock import add_lock
from drake_disasm.common.program import argument_parser, run
from drake_disasm.common.spatial import rotation_vector
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.parts import ContactConfig, Part, PegInHole
from drake_disasm.policies import make_policy
from drake_disasm.scenario import SimulationConfig, load_scenario
from drake_disasm.stations.wiring import add_plant
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation

_NAME = "benchmarks/parts.py"
QUIET = "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"
_SCENARIOS = ("removal", "iiwa_peg", "iiwa_bayonet")
_LEARNING = "Policies of all seeds of a training, evaluated without exploration"
_LEARNING_COLUMNS = (
    *("scenario", "station", "policy", "seeds that always succeed"),
    *("episodes that succeed", "P (median of seeds)", "mean peak F [N]"),
)

Rows = list[tuple[Cell, ...]]


def pulled(
    part: Part,
    friction: float,
    offset: float,
    force: float = 5.0,
    duration: float = 0.2,
) -> float:
    """Returns how far a part that nothing holds has come along y [m].

    Args:
        part: of which the moved body is free, without weight.
        friction: coefficient.
        offset: of the force from Bo, along z [m].
        force: along y [N].
        duration: of the pull [s].
    """
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, SimulationConfig(), 0.001)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    contact = ContactConfig(friction=friction)
    lock = add_lock(plant, plant.world_frame(), part, contact)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    pull = ExternallyAppliedSpatialForce()
    pull.body_index, pull.p_BoBq_B = lock.bolt.index(), np.array([0.0, 0.0, offset])
    pull.F_Bq_W = SpatialForce(tau=np.zeros(3), f=[0.0, force, 0.0])
    plant.get_applied_spatial_force_input_port().FixValue(context, [pull])
    simulator.AdvanceTo(duration)
    return float(plant.EvalBodyPoseInWorld(context, lock.bolt).translation()[1])


def play(*overrides: str, force: float = 1.0) -> float:
    """Returns how far a peg moves along z between +force and -force on it [m].

    Args:
        overrides: of the scenario.
        force: across the hole [N].
    """
    stiff = "gripper.compliance=rigid"
    scenario = load_scenario("iiwa_peg", [QUIET, stiff, *overrides])
    simulation = TaskSimulation(scenario, "twin")
    ends = []
    for sign in (1.0, -1.0):
        simulation.reset(0)
        pushed, f_z = 0.4 * scenario.part.clearance, 0.0
        while abs(f_z) < force:
            s = simulation.step(np.array([0, 0, sign * pushed, 0, 0, 0])).observation
            f_z, pushed = float(s[8]), 2e-6
        X_GB = simulation.evaluate(simulation.station, "bolt_pose_in_groove")
        ends.append(X_GB.translation()[2])
    return float(ends[0] - ends[1])


def detent(step: float = 0.01, until: float = 0.25) -> list[tuple[float, float, float]]:
    """Returns a bayonet's angle [rad], its spring's torque and the sensor's [N m].

    Args:
        step: of the turn [rad].
        until: which commanded angle.
    """
    scenario = load_scenario("iiwa_bayonet", [QUIET])
    simulation, rows = TaskSimulation(scenario, "twin"), []
    simulation.reset(0)
    part, contact = scenario.part, scenario.contact
    for _ in range(round(until / step)):
        s = simulation.step(np.array([0, 0, 0, 0, step, 0])).observation
        X_GB = simulation.evaluate(simulation.station, "bolt_pose_in_groove")
        stated = part.spring_wrench(X_GB, part.environment(contact))[4]
        angle = float(rotation_vector(X_GB.rotation())[1])
        rows.append((angle, float(stated), float(s[10])))
    return rows


def _play_rows() -> Iterator[tuple[Cell, ...]]:
    sections = ("round", "square")
    for section, stated in itertools.product(sections, (2e-5, 1e-4, 2e-4, 1e-3)):
        found = play(f"part.cross_section={section}", f"part.clearance={stated}")
        more = 1e6 * (found - stated)
        yield section, 1e3 * stated, round(1e3 * found, 4), round(more, 1)


def _jamming_rows() -> Iterator[tuple[Cell, ...]]:
    peg = PegInHole()
    for friction, share in itertools.product((0.2, 0.5), (0.5, 0.8, 0.9, 1.1, 1.25, 2)):
        limit = peg.depth / (2 * friction)
        way = pulled(peg, friction, share * limit)
        slides = "slides" if share < 1 else "jams"
        yield friction, round(1e3 * limit, 1), share, slides, round(1e3 * way, 3)


def _detent_rows() -> Iterator[tuple[Cell, ...]]:
    for angle, stated, read in detent()[::3]:
        yield tuple(round(value, 4) for value in (angle, stated, read))


def _episode(scenario: str, station: str, *overrides: str) -> dict[str, float]:
    """Returns figures of the baseline's episode without noise."""
    loaded = load_scenario(scenario, [QUIET, *overrides])
    policy = make_policy("admittance", loaded)
    simulation = TaskSimulation(loaded, station, policy)
    begin = time.perf_counter()
    summary = dataclasses.asdict(run_episode(simulation, 0))
    return summary | {"rate": simulation.time / (time.perf_counter() - begin)}


def _time_step_rows() -> Iterator[tuple[Cell, ...]]:
    steps = {"twin": 0.005, "cell": 0.0025}
    for scenario, (station, step) in itertools.product(_SCENARIOS, steps.items()):
        for h in (step, step / 2):
            found = _episode(scenario, station, f"simulation.{station}_time_step={h}")
            figures = (found["max_force"], found["max_torque"], found["steps"])
            rounded = (round(float(figure), 3) for figure in figures)
            yield scenario, station, 1e3 * h, *rounded


def _contact_rows() -> Iterator[tuple[Cell, ...]]:
    for scenario, contact in itertools.product(_SCENARIOS, ("hydroelastic", "impact")):
        found = _episode(scenario, "twin", f"contact.model={contact}")
        names = ("steps", "mean_force", "max_force", "max_torque")
        yield scenario, contact, *(round(float(found[name]), 3) for name in names)


def learning_rows(files: Sequence[Path]) -> Iterator[tuple[Cell, ...]]:
    """Yields what evaluations say of each training, and of each other policy.

    Args:
        files: that `drake-disasm evaluate --json` has written.
    """
    rows = [row for file in files for row in json.loads(file.read_text())["rows"]]
    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        path = Path(row["policy"])  # TRAINING/seed_000/policy.npz
        name = path.parts[-3] if len(path.parts) > 2 else path.name
        scenario = Path(row["scenario"]).stem
        groups.setdefault((scenario, row["station"], name), []).append(row)
    for key, own in groups.items():
        right, count = (sum(r[name] for r in own) for name in ("successes", "episodes"))
        low, high = (f"{100 * end:.0f}" for end in wilson_interval(right, count))
        whole = sum(r["successes"] == r["episodes"] for r in own)
        performance, peak = (
            round(float(np.median([r[name] for r in own])), 2)
            for name in ("performance", "mean_peak_force")
        )
        of_all = f"{right} of {count} ({low} to {high} %)"
        yield *key, f"{whole} of {len(own)}", of_all, performance, peak


def _speed_rows() -> Iterator[tuple[Cell, ...]]:
    for station in ("twin", "cell"):
        rates = {name: _episode(name, station)["rate"] for name in _SCENARIOS}
        for name, rate in rates.items():
            share = rate / rates[_SCENARIOS[0]]
            yield name, station, round(rate, 2), round(share, 2)


@dataclasses.dataclass(frozen=True)
class _Table:
    """A table of this program: its caption, heads, and what makes its rows."""

    title: str
    columns: tuple[str, ...]
    rows: Callable[[], Iterator[tuple[Cell, ...]]]


TABLES = {
    "play": _Table(
        "Play of a peg at 1 N",
        ("cross-section", "clearance [mm]", "play [mm]", "more [um]"),
        _play_rows,
    ),
    "jamming": _Table(
        "A peg that is pulled beside its axis, 0.2 s at 5 N",
        ("friction", "l / (2 mu) [mm]", "offset / that", "Whitney", "came [mm]"),
        _jamming_rows,
    ),
    "detent": _Table(
        "Torque of a bayonet's detent",
        ("angle [rad]", "of the spring [N m]", "of the sensor [N m]"),
        _detent_rows,
    ),
    "time_steps": _Table(
        "Admittance at the shipped time step and at half of it, without noise",
        ("scenario", "station", "step [ms]", "max F [N]", "max T [N m]", "steps"),
        _time_step_rows,
    ),
    "contact": _Table(
        "Admittance on the twin with either contact, without noise",
        ("scenario", "contact", "steps", "mean F [N]", "max F [N]", "max T [N m]"),
        _contact_rows,
    ),
    "speed": _Table(
        "Real-time factor of an episode, and as a share of the door chain's",
        ("scenario", "station", "times real time", "share"),
        _speed_rows,
    ),
}


def main(arguments: Sequence[str]) -> int:
    """Prints a table; returns the exit status."""
    args = parse(arguments)
    if args.table == "learning":
        table = _Table(args.title, _LEARNING_COLUMNS, lambda: learning_rows(args.files))
    else:
        table = TABLES[args.table]
    rows: Rows = list(table.rows())
    print(markdown(table.columns, rows))
    write_result(args.results, table.title, table.columns, rows, _NAME, arguments)
    return 0


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_NAME}", __doc__, "")
    names = (*TABLES, "learning")
    parser.add_argument("table", choices=names, help=f"one of {', '.join(names)}")
    parser.add_argument(
        "files", nargs="*", type=Path, help="with learning: evaluations"
    )
    parser.add_argument(
        "--title", default=_LEARNING, help="of the table of evaluations"
    )
    add_results_argument(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    run(main)
