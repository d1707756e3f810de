"""What every station has, simulated or real."""

import dataclasses
import functools
from collections.abc import Callable, Sequence

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, InputPort, OutputPort, System
from pydrake.systems.primitives import RandomSource

from drake_disasm.cell.arm_model import arm_joints
from drake_disasm.cell.coordinates import ArmCoordinates, Coordinates
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.sensor import sensor_under_part
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.ports import Port, cell_ports
from drake_disasm.common.quantity import closest
from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.devices.sensor_chain import Payload
from drake_disasm.effects import BoltMotion, Effect
from drake_disasm.scenario import Scenario
from drake_disasm.systems.observation import Mounting

#: Ports that simulated stations have besides their table, and hardware has not.
SIMULATION_ONLY = (
    "applied_spatial_force",
    "bolt_pose",
    "bolt_pose_in_groove",
    "contact_results",
    "query_object",
)

#: Returns the Context of a part of a station.
Parts = Callable[[System], Context]


@dataclasses.dataclass(frozen=True)
class InitialState:
    """Start of an episode, for the systems that process commands and readings.

    Attributes:
        position: (n,) coordinates from which motion is commanded.
        reading: (6,) of the sensor there, noise averaged away.
        force: true magnitude of the force on the bolt there, which zeroing the sensor
            hides [N]; NaN where nobody knows it, on hardware.
    """

    position: np.ndarray
    reading: np.ndarray
    force: float = np.nan


class Station(Diagram):
    """A diagram with the station's ports, and the data that the task layer needs.

    Attributes:
        scenario: what it was built from.
        kind: its name among STATIONS.
        table: its port table.
        simulation_only: ports that every simulated station has besides its table, and
            hardware has not: ask `HasOutputPort` or `HasInputPort` before using one in
            a diagram that is to run on both.
        arm: the device whose position is commanded: the arm's name, or "bolt".
        joints: names of the arm's joints, from its base; the twin has none.
        has_velocity_input: whether `<arm>.velocity` is an input as well.
        control_period: at which `<arm>.position` is read [s].
        grip_command: what to send to `gripper.position` [m]; None has no gripper.
        start_is_reusable: whether an episode that begins from a copy of an earlier
            one's first Context begins the same.
        coordinates: maps the arm's coordinates to X_GB and back.
        start: the coordinates (n,) at which an episode starts, X_GB = identity.
        X_SB: the bolt in the sensor frame, as grasped.
        X_GS: a sensor under the fixed part, in Gn; None: it moves with the bolt.
        payload_mass, p_SoScm_S: what the sensor carries [kg], (3,) [m].
        X_WG: the groove's nominal frame in the world.
        g_W: gravity (3,) [m/s^2].
    """

    scenario: Scenario
    kind: str
    table: tuple[Port, ...]
    simulation_only: tuple[str, ...] = SIMULATION_ONLY
    arm: str
    joints: tuple[str, ...] = ()
    has_velocity_input: bool
    control_period: float
    grip_command: float | None = None
    start_is_reusable: bool = True
    coordinates: Coordinates
    start: np.ndarray
    X_SB: RigidTransform
    X_GS: RigidTransform | None = None
    payload_mass: float
    p_SoScm_S: np.ndarray
    X_WG: RigidTransform
    g_W: np.ndarray

    def GetOutputPort(self, port_name: str) -> OutputPort:
        """Returns an output port by its name.

        Raises:
            DisasmError: the station has no such output; names those that it has.
        """
        if not self.HasOutputPort(port_name):
            ports = map(self.get_output_port, range(self.num_output_ports()))
            self._refuse_port(port_name, "output", [port.get_name() for port in ports])
        return super().GetOutputPort(port_name)

    def GetInputPort(self, port_name: str) -> InputPort:
        """Returns an input port by its name.

        Raises:
            DisasmError: the station has no such input; names those that it has.
        """
        if not self.HasInputPort(port_name):
            ports = map(self.get_input_port, range(self.num_input_ports()))
            self._refuse_port(port_name, "input", [port.get_name() for port in ports])
        return super().GetInputPort(port_name)

    def _refuse_port(self, name: str, direction: str, own: Sequence[str]) -> None:
        """Raises DisasmError for a port that the station lacks."""
        near = closest(name, list(own))
        guess = f" {near}" if near.startswith("did you mean") else ""
        has = f"it has: {', '.join(own)}"
        if self.kind == "hardware":
            ask = f"station.Has{direction.capitalize()}Port"
            has += (
                f"; only in simulation: {', '.join(self.simulation_only)} (ask {ask})"
            )
        raise DisasmError(f"{self.kind} has no {direction} '{name}';{guess} {has}")

    @property
    def payload(self) -> Payload:
        """The payload that the sensor is known to carry."""
        return Payload(self.payload_mass, self.p_SoScm_S, self.g_W)

    @functools.cached_property
    def mounting(self) -> Mounting:
        """How the sensor sits between bolt and robot, and what it carries."""
        return Mounting(
            self.X_SB,
            self.X_WG.rotation(),
            self.payload_mass,
            self.p_SoScm_S,
            self.g_W,
            self.X_GS,
        )

    @property
    def random_sources(self) -> tuple[RandomSource, ...]:
        """Sources of randomness, reseeded at the start of each episode."""
        return ()

    @property
    def initial_state(self) -> InitialState:
        """Where an episode begins by the default Context.

        Raises:
            DisasmError: it is known only after `begin`, as on hardware.
        """
        raise NotImplementedError  # Drake's metaclass leaves no room for ABC's

    def begin(
        self, context: Context, effects: Sequence[Effect] | None = None
    ) -> InitialState:
        """Brings the station to where an episode begins.

        Args:
            context: its own, in a diagram whose time is zero.
            effects: that act in it; None means the scenario's own.

        Raises:
            DisasmError: the station can't carry one of the effects.
        """
        raise NotImplementedError

    def refuse_effects(self, effects: Sequence[Effect]) -> None:
        """Raises DisasmError if the station can't carry one of the effects."""
        raise NotImplementedError

    def attach(self, simulator: Simulator) -> None:
        """Keeps effects that depend on the bolt's motion up to date in a simulation.

        They are updated once per task period, from the bolt's pose and its commanded
        velocity, by a simulator monitor. A monitor that the simulator already has
        stays in use; one that is set later replaces this one.

        Args:
            simulator: of the diagram with this station, before it is initialised.
        """

    def register_caller_updates(self, simulator: Simulator) -> None:
        """Declares that the caller calls `update_local_effects` itself, every period.

        Args:
            simulator: of the diagram with this station, before it is initialised.
        """

    def register_motion_effects(self) -> None:
        """Declares that the diagram around the station applies motion effects."""

    def effects_in_force(self, context: Context) -> tuple[Effect, ...]:
        """Returns the effects that are in force in this station's Context."""
        return ()

    def update_local_effects(
        self, context: Context, effects: Sequence[Effect], bolt: BoltMotion
    ) -> None:
        """Updates effects that depend on the bolt's motion; see SimulatedStation."""

    def register_part(self, name: str, stopwatch: Stopwatch) -> None:
        """Declares a part of the diagram around the station, by what it takes.

        A station that keeps real time names the slow one when the diagram is late.
        """

    def check(self) -> None:
        """Raises DisasmError if the station no longer accepts commands."""

    def _set_arm(self) -> None:
        """Sets the arm's name, its joints, and the ports that go by them."""
        self.arm = self.scenario.arm.name
        self.joints = arm_joints(self.scenario.arm)
        self.table = cell_ports(self.arm, len(self.joints))

    def _set_cell_geometry(self) -> Tool:
        """Sets the geometry of arm, tool and lock; returns the tool."""
        scenario, tool = self.scenario, Tool.from_models(self.scenario)
        self.control_period = scenario.arm.control_period
        self.X_WG = nominal_groove_pose(scenario.placement)
        self.X_SB = tool.X_SB
        self._set_payload(tool.mass, tool.p_SoScm_S)
        self.coordinates = ArmCoordinates(
            scenario.arm, self.X_WG, tool.X_FB, scenario.task.period
        )
        self.start = self.coordinates.start(RigidTransform())
        return tool

    def _set_payload(self, mass: float, p_SoScm_S: np.ndarray) -> None:
        """Sets what the sensor carries; under the fixed part, that is the part.

        Args:
            mass, p_SoScm_S: of what moves with the bolt [kg], (3,) [m].
        """
        if self.scenario.ft_sensor.place == "part":
            self.X_GS, M_S = sensor_under_part(self.scenario)
            mass, p_SoScm_S = M_S.get_mass(), M_S.get_com()
        self.payload_mass, self.p_SoScm_S = mass, p_SoScm_S


def refuse_twins_contact(scenario: Scenario) -> None:
    """Refuses a contact model that only the twin has.

    Raises:
        DisasmError: says what to use instead.
    """
    if scenario.contact.model != "hydroelastic":
        raise DisasmError(
            f"contact.model: '{scenario.contact.model}' is available on the twin only; "
            "use hydroelastic, or `station` twin"
        )


def add_nominal_groove(plant: MultibodyPlant, X_WG: RigidTransform) -> Frame:
    """Returns the groove's nominal frame, added to a plant."""
    world = plant.world_frame()
    return plant.AddFrame(FixedOffsetFrame("groove_nominal", world, X_WG))
