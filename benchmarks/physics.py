"""Contact, time steps and the arm, against statics and against themselves refined.

Prints tables of lengths, forces and stiffnesses, in parts that can be asked for.
"""

import time
from collections.abc import Iterator, Sequence

import numpy as np
from compliance import QUIET, Push

from drake_disasm.cell.arm_control import joint_gains
from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.common import program
from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.effects import GroovePose
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation
from drake_disasm.task.simulation import TaskSimulation

#: A grip that does not yield: a millimetre beside the groove is ten newtons.
STIFF = "gripper.compliance=rigid"
#: Those in which a policy runs without being trained, and each episode is the same.
SCENARIOS = (
    "removal",
    "removal_turned",
    *(f"chapter{n}{v}" for n in (3, 4, 5) for v in ("", "_impedance", "_stiff")),
)


def quiet(scenario: str = "removal", *overrides: str) -> TaskSimulation:
    """Returns a twin without noise or policy."""
    return TaskSimulation(load_scenario(scenario, [QUIET, *overrides]), "twin")


def action(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    """Returns a translation (6,) [m]."""
    return np.array([x, y, z, 0.0, 0.0, 0.0])


def play(force: float, *overrides: str, ry: float = 0.0) -> float:
    """Returns how far the neck moves across the slot between +force and -force [m].

    Args:
        force: across the slot [N].
        overrides: of the scenario.
        ry: by which the groove is turned [rad].
    """
    simulation = quiet("removal", STIFF, *overrides)
    R_GnG = rotation_from_vector(np.array([0.0, ry, 0.0]))

    def move(x: float, z: float) -> tuple[float, float]:
        """Moves along and across the groove; returns z and f_z in G."""
        s = simulation.step(action(*(R_GnG @ np.array([x, 0.0, z])))).observation
        X_GnB, R_GGn = (
            simulation.evaluate(simulation.station, "bolt_pose"),
            R_GnG.inverse(),
        )
        return (R_GGn @ X_GnB.translation())[2], (R_GGn @ s[6:9])[2]

    ends = []
    for sign in (1.0, -1.0):
        simulation.reset(0, [GroovePose(ry=ry)])
        move(3e-3, 0.0)
        z, f_z = move(0.0, sign * 4e-5)
        while abs(f_z) < force:
            z, f_z = move(0.0, sign * 1e-5)
        ends.append(z)
    return ends[0] - ends[1]


def sliding(mu: float, offset: float) -> tuple[float, float]:
    """Returns mean normal and friction force [N] of a bolt sliding along a lip.

    Args:
        mu: Coulomb coefficient.
        offset: commanded sideways position, beyond the play [m].
    """
    simulation = quiet("removal", STIFF, f"contact.friction={mu}")
    simulation.reset(0)
    simulation.step(action(z=offset))
    states = [simulation.step(action(x=1e-3)).observation for _ in range(30)]
    steady = np.array(states)[15:]
    return float(abs(steady[:, 8]).mean()), float(-steady[:, 6].mean())


def episode(
    model: str, policy: str, *overrides: str, scenario: str = "removal_turned"
) -> dict[str, float]:
    """Returns end pose [m], force peaks [N] and speed of a noise-free episode.

    `slide` is the greatest force before the bolt meets stop B (x < 59 mm).
    """
    loaded = load_scenario(scenario, [QUIET, *overrides])
    simulation = TaskSimulation(loaded, model, make_policy(policy, loaded))
    simulation.reset(0)
    states, result, start = [], None, time.perf_counter()
    while result is None or result.outcome is Outcome.RUNNING:
        result = simulation.step()
        states.append(result.observation)
    wall = time.perf_counter() - start
    s = np.array(states)
    force = np.linalg.norm(s[:, 6:9], axis=1)
    return {
        "x": s[-1, 0],
        "y": s[-1, 1],
        "z": s[-1, 2],
        "travel": s[:, 0].max(),
        "slide": force[s[:, 0] < 0.059].max(),
        "mean": force.mean(),
        "peak": force.max(),
        "success": float(result.outcome is Outcome.SUCCESS),
        "steps": simulation.steps,
        "rate": simulation.time / wall,
    }


def replay_errors(
    steps: Sequence[float], reference: float, *overrides: str
) -> dict[float, np.ndarray]:
    """Returns median and 95 and 99 % quantile (3,) of the force error [N] per step.

    The error is that of noisy actions replayed at coarser time steps.

    Ten episodes of `admittance` on the twin with 0.15 mm of noise on its actions are
    run at the reference step; the other steps get the same actions, open loop.
    """
    twins = {
        step: quiet("removal", f"simulation.twin_time_step={step}", *overrides)
        for step in (reference, *steps)
    }
    policy, random = make_policy("admittance"), np.random.default_rng(0)
    forces: dict[float, list[np.ndarray]] = {step: [] for step in twins}
    for seed in range(10):
        states = {step: twin.reset(seed) for step, twin in twins.items()}
        for _ in range(60):
            noise = np.concatenate([random.normal(0, 1.5e-4, 3), np.zeros(3)])
            noisy = policy(states[reference]) + noise
            for step, twin in twins.items():
                states[step] = twin.step(noisy).observation
                forces[step].append(states[step][6:9])
    true = np.array(forces[reference])
    errors = {s: np.linalg.norm(np.array(forces[s]) - true, axis=1) for s in steps}
    return {s: np.quantile(error, [0.5, 0.95, 0.99]) for s, error in errors.items()}


def pushed(
    station: CellStation, wrench_G: Sequence[float] | np.ndarray, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns true and measured displacement (6,) of a bolt pushed in free space.

    Args:
        station: the cell.
        wrench_G: [f; tau] on the bolt at Bo in G, from the start on.
        duration: how long [s].
    """
    place = Push(station, np.zeros(3)).advance(np.array(wrench_G), duration)
    return place.bolt, place.measured


def stiffness(
    station: CellStation, loads: Sequence[float], duration: float = 0.6
) -> np.ndarray:
    """Returns load over displacement along each axis, (6, 2): bolt, measured pose.

    Args:
        station: the cell.
        loads: (6,) one at a time [N, N m].
        duration: of each; an arm that yields takes its time [s].
    """
    rest = pushed(station, np.zeros(6), duration)
    table = np.zeros((6, 2))
    for axis, load in enumerate(loads):
        moved = pushed(station, load * np.eye(6)[axis], duration)
        table[axis] = [load / (moved[i] - rest[i])[axis] for i in range(2)]
    return table


def stated_stiffness(station: CellStation) -> np.ndarray:
    """Returns the stiffness per axis (6,) that the arm's controller states."""
    arm, coordinates = station.scenario.arm, station.coordinates
    if arm.control == "cartesian_impedance":
        return np.array(arm.cartesian_impedance.stiffness)
    assert isinstance(coordinates, ArmCoordinates)
    K = coordinates.stiffness(joint_gains(arm, np.zeros(7))[0], station.start)
    return 1.0 / np.diag(np.linalg.inv(K))


def _control_lines() -> Iterator[str]:
    yield "the arm's controls: axis, stated, measured pose, difference %"
    for control, duration in (
        ("position", 0.6),
        ("joint_impedance", 1.2),
        ("cartesian_impedance", 2.4),
    ):
        yield f"  {control}"
        overrides = [f"arm.control={control}", "gripper.compliance=rigid"]
        scenario = load_scenario("removal", [QUIET, "gripper.hold=weld", *overrides])
        station = CellStation(scenario)
        stated = stated_stiffness(station)
        table = stiffness(station, [5, 5, 5, 0.1, 0.1, 0.1], duration)
        for axis, found in enumerate(table[:, 1]):
            off = 100 * (found / stated[axis] - 1)
            yield f"  {'xyzuvw'[axis]} {stated[axis]:.0f} {found:.0f} {off:+.2f}"


def _scenario_lines() -> Iterator[str]:
    keys = ("success", "x", "y", "mean", "peak", "steps", "rate")
    yield f"scenarios, without noise: {', '.join(keys)} (m, N, times real time)"
    for name in SCENARIOS:
        for policy in ("admittance", "straight"):
            for model in ("cell", "twin"):
                run = episode(model, policy, scenario=name)
                values = " ".join(f"{run[key]:.4g}" for key in keys)
                yield f"  {name} {policy} {model}: {values}"


def _contact_lines() -> Iterator[str]:
    yield "play of the neck at 1 N (mm): nominal, measured, excess %"
    for clearance in (1e-4, 2e-4, 4e-4, 1e-3):
        found = play(1.0, f"part.clearance={clearance}")
        excess = 100 * (found / clearance - 1)
        yield f"  {1e3 * clearance:.1f} {1e3 * found:.4f} {excess:+.1f}"
    yield "play on a turned groove: degrees, nominal mm, excess %"
    for degrees in (2.0, 4.0):
        for clearance in (1e-4, 4e-4):
            override = f"part.clearance={clearance}"
            found = play(1.0, override, ry=np.deg2rad(degrees))
            excess = 100 * (found / clearance - 1)
            yield f"  {degrees} {1e3 * clearance:.1f} {excess:+.1f}"
    yield "play at 0.4 mm nominal for other meshes and moduli"
    for setting in (
        "contact.resolution=0.003",
        "contact.resolution=0.0016",
        "contact.resolution=0.0008",
        "contact.resolution=0.0004",
        "contact.modulus=1e8",
        "contact.modulus=1e10",
    ):
        yield f"  {setting} {1e3 * play(1.0, setting):.4f}"
    yield "friction: mu, normal N, friction N, ratio"
    for mu in (0.1, 0.2, 0.4):
        for offset in (4e-4, 1e-3):
            normal, friction = sliding(mu, offset)
            yield f"  {mu} {normal:.3f} {friction:.3f} {friction / normal:.4f}"


def _time_step_lines() -> Iterator[str]:
    for model, steps in (
        ("twin", (0.0025, 0.005, 0.01, 0.02)),
        ("cell", (0.000625, 0.00125, 0.0025, 0.005)),
    ):
        for policy in ("admittance", "straight"):
            yield f"time step of the {model}, {policy} on the turned groove"
            for step in steps:
                run = episode(model, policy, f"simulation.{model}_time_step={step}")
                yield f"  {1e3 * step:.3f} ms  " + "  ".join(
                    f"{k} {1e3 * v:.4f}"
                    if k in "xyz" or k == "travel"
                    else f"{k} {v:.3f}"
                    for k, v in run.items()
                )
    yield "cell away from the shipped settings: change of the peak by half the step, %"
    for policy, overrides in (
        ("admittance", ["effects.0.ry=0.0698"]),
        ("admittance", ["gripper.hold=weld"]),
        ("admittance", ["effects.0.ry=0.0698", "gripper.hold=weld"]),
        ("straight", ["part.clearance=0.001"]),
        ("straight", ["part.clearance=0.001", "gripper.hold=weld"]),
    ):
        whole, half = (
            episode("cell", policy, f"simulation.cell_time_step={step}", *overrides)
            for step in (0.0025, 0.00125)
        )
        change = 100 * (half["peak"] / whole["peak"] - 1)
        yield f"  {policy} {' '.join(overrides)} {change:+.2f}"
    yield "replayed noisy actions: twin's step ms, force error N (50, 95, 99 %)"
    for modulus in ("4e7", "4e9"):
        yield f"  head_modulus {modulus}"
        override = f"contact.head_modulus={modulus}"
        steps = (0.0025, 0.005, 0.01, 0.02)
        for step, error in replay_errors(steps, 0.00125, override).items():
            yield f"  {1e3 * step:.1f} " + " ".join(f"{e:.3f}" for e in error)


def _arm_lines() -> Iterator[str]:
    station = CellStation(load_scenario("removal", [QUIET]))
    yield "stiffness per axis: stated, measured pose, bolt"
    stated = stated_stiffness(station)
    for axis, row in enumerate(stiffness(station, [5, 5, 5, 0.1, 0.1, 0.02])):
        yield f"  {'xyzuvw'[axis]} {stated[axis]:.0f} {row[1]:.0f} {row[0]:.0f}"
    yield "creep under a steady 1 N along x (mm): after 1, 5, 10 s"
    bolt = [pushed(station, [1, 0, 0, 0, 0, 0], t)[0][0] for t in (1.0, 5.0, 10.0)]
    yield "  " + " ".join(f"{1e3 * x:.4f}" for x in bolt)


PARTS = {
    "contact": _contact_lines,
    "time_steps": _time_step_lines,
    "arm": _arm_lines,
    "controls": _control_lines,
    "scenarios": _scenario_lines,
}


def main(arguments: Sequence[str]) -> int:
    """Prints the tables; returns the exit status."""
    parser = program.argument_parser("python benchmarks/physics.py", __doc__, "")
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART",
        help=f"of {', '.join(PARTS)} (default: all)",
    )  # fmt: skip
    for part in parser.parse_args(arguments).only:
        for line in PARTS[part]():
            print(line, flush=True)
    return 0


if __name__ == "__main__":
    program.run(main)
