"""How grip and arm yield: stated against measured, in cell and twin.

Prints stiffness, release and creep, by the arm's control and the kind of fingers.
"""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator

from drake_disasm.cell.grip import Springs, grip_springs
from drake_disasm.cell.tool import Tool
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common import program
from drake_disasm.common.spatial import rotation_vector, velocity_shift
from drake_disasm.effects import GroovePose
from drake_disasm.scenario import CONTROLS, Scenario, load_scenario
from drake_disasm.stations import SimulatedStation, make_station

QUIET = "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"
AWAY = GroovePose(y=-0.01)  # the groove drops away from the bolt

LOADS = np.array([2.0, 2.0, 2.0, 0.05, 0.05, 0.05])  # N, N m
SETTLES = {"position": 0.8, "joint_impedance": 1.5, "cartesian_impedance": 3.0}  # s
_TEN_PERCENT = 3.8897  # omega t at which a critically damped release is down to 10 %
AXES = ("x", "y", "z", "about x", "about y", "about z")


@dataclasses.dataclass(frozen=True)
class Place:
    """Displacement and rotation (6,) of a point since the start, in Gn [m, rad].

    Attributes:
        bolt: as it truly is.
        measured: as the arm's encoders have it.
    """

    bolt: np.ndarray
    measured: np.ndarray

    @property
    def grip(self) -> np.ndarray:
        """By how much the grip gives."""
        return self.bolt - self.measured


class Push:
    """A station in free space whose bolt is pushed at a point of the bolt.

    Args:
        station: the cell or the twin.
        p: (3,) the point, in B.
    """

    def __init__(self, station: SimulatedStation, p: np.ndarray) -> None:
        self._station, self._p = station, p
        self.simulator: Simulator = station.at_start([AWAY])
        self._context = self.simulator.get_mutable_context()

    def advance(self, wrench: np.ndarray, time: float) -> Place:
        """Pushes with a wrench (6,) [f; tau] in Gn until a time [s]."""
        station, R_WG = self._station, self._station.X_WG.rotation().matrix()
        force = ExternallyAppliedSpatialForce()
        force.body_index = station.lock.bolt.index()
        force.p_BoBq_B = self._p
        force.F_Bq_W = SpatialForce(R_WG @ wrench[3:], R_WG @ wrench[:3])
        port = station.GetInputPort("applied_spatial_force")
        value = Value[list[ExternallyAppliedSpatialForce]]([force])
        port.FixValue(self._context, value)
        self.simulator.AdvanceTo(time)
        coordinates = station.GetOutputPort(f"{station.arm}.position_measured").Eval(
            self._context
        )
        truth = station.GetOutputPort("bolt_pose").Eval(self._context)
        return Place(
            self._moved(truth), self._moved(station.coordinates.pose(coordinates))
        )

    def _moved(self, X_GB: RigidTransform) -> np.ndarray:
        turn = rotation_vector(X_GB.rotation())
        return np.concatenate([X_GB @ self._p - self._p, turn])


def stiffness(station: SimulatedStation, p: np.ndarray, time: float) -> np.ndarray:
    """Returns load over displacement (3, 6) of measured pose, bolt, and grip alone.

    Args:
        station: the cell or the twin.
        p: (3,) where the bolt is pushed, in B.
        time: after which the displacement is read [s].
    """
    rest = Push(station, p).advance(np.zeros(6), time)
    found = np.zeros((3, 6))
    for axis, load in enumerate(LOADS):
        place = Push(station, p).advance(load * np.eye(6)[axis], time)
        moved = place.measured - rest.measured, place.bolt - rest.bolt
        for row, way in enumerate((*moved, moved[1] - moved[0])):
            found[row, axis] = load / way[axis]
    return found


def stated(scenario: Scenario) -> np.ndarray:
    """Returns the same (3, 6) by the twin's parameters: at Bo, each axis by itself."""
    twin = twin_of(scenario)
    S = velocity_shift(twin.p_BoTo_B)
    arm = S @ np.linalg.inv(twin.arm.K) @ S.T
    grip = S @ np.diag(1.0 / twin.grip.stiffness) @ S.T
    return np.array([1.0 / np.diag(C) for C in (arm, arm + grip, grip)])


def release_time(station: SimulatedStation, p: np.ndarray, axis: int) -> float:
    """Returns the time [s] in which a released grip is back to a tenth."""
    push = Push(station, p)
    load = LOADS[axis] * np.eye(6)[axis]
    at_load = push.advance(load, 0.8).grip[axis]
    step, time = 0.0025, 0.8
    rest = Push(station, p).advance(np.zeros(6), 0.8).grip[axis]
    while time < 2.0:
        time += step
        left = (push.advance(np.zeros(6), time).grip[axis] - rest) / (at_load - rest)
        if abs(left) < 0.1:
            break
    return time - 0.8


def creep(station: SimulatedStation, axis: int, times: Sequence[float]) -> list[float]:
    """Returns displacements of the grip [m, rad] under a steady load, per unit."""
    push = Push(station, np.zeros(3))
    load = LOADS[axis] * np.eye(6)[axis]
    return [push.advance(load, time).grip[axis] / LOADS[axis] for time in times]


def _springs(scenario: Scenario) -> Springs:
    return grip_springs(scenario.gripper, Tool.from_models(scenario))


def _lines() -> Iterator[str]:
    yield "station, control, grip, step ms: stiffness of arm | bolt | grip, per axis"
    for compliance in ("adaptive", "rigid"):
        for control in CONTROLS:
            yield from _stiffness_lines(compliance, control)
    yield "time from release to a tenth, ms, at the pads: axis, stated, cell, twin"
    scenario = load_scenario("removal", [QUIET])
    stations = [make_station(name, scenario) for name in ("cell", "twin")]
    springs, p = _springs(scenario), Tool.from_models(scenario).p_BoTo_B
    for axis, name in enumerate(AXES):
        omega = 2.0 * springs.stiffness[axis] / springs.damping[axis]
        found = [release_time(station, p, axis) for station in stations]
        row = [_TEN_PERCENT / omega, *found]
        yield f"  {name} " + " ".join(f"{1e3 * t:.1f}" for t in row)
    yield "creep of the grip under a steady load, per N or N m, after 1, 5, 10 s"
    for name, station in (("adaptive", stations[0]), ("rigid", _rigid_cell())):
        for axis in range(6):
            found = creep(station, axis, (1.0, 5.0, 10.0))
            numbers = " ".join(f"{1e3 * value:.4f}" for value in found)
            yield f"  {name} {AXES[axis]} {numbers} (mm or mrad)"


def _rigid_cell() -> SimulatedStation:
    return make_station(
        "cell", load_scenario("removal", [QUIET, "gripper.compliance=rigid"])
    )


def _stiffness_lines(compliance: str, control: str) -> Iterator[str]:
    overrides = [QUIET, f"gripper.compliance={compliance}", f"arm.control={control}"]
    scenario = load_scenario("removal", overrides)
    yield f"  stated {control} {compliance}: " + _table(stated(scenario))
    for name, step in (("cell", 2.5), ("cell", 1.25), ("twin", 5.0), ("twin", 2.5)):
        key = f"simulation.{name}_time_step={1e-3 * step}"
        station = make_station(name, load_scenario("removal", [*overrides, key]))
        found = stiffness(station, np.zeros(3), SETTLES[control])
        yield f"  {name} {step} ms: " + _table(found)


def _table(rows: np.ndarray) -> str:
    return " | ".join(" ".join(f"{value:.4g}" for value in row) for row in rows)


def main(arguments: Sequence[str]) -> int:
    """Prints the tables; returns the exit status."""
    program.argument_parser("python benchmarks/compliance.py", __doc__, "").parse_args(
        arguments
    )
    for line in _lines():
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    program.run(main)
