"""The schema of a scenario: a dataclass for each part, with valid defaults."""

import dataclasses

from drake_disasm.common.quantity import quantity
from drake_disasm.effects import Effect
from drake_disasm.parts import ContactConfig, DoorChain, Part

#: KUKA's control modes that take joint angles from FRI.
CONTROLS = ("position", "joint_impedance", "cartesian_impedance")


@dataclasses.dataclass
class SimulationConfig:
    """How the MultibodyPlant is discretised, see docs/explanation/physics.md."""

    cell_time_step: float = quantity(0.0025, "s", "of the cell", low=1e-4, high=0.02)
    twin_time_step: float = quantity(0.005, "s", "of the twin", low=1e-4, high=0.02)
    stiction_tolerance: float = quantity(
        1e-5, "m/s", "creep at which friction is full", low=1e-7, high=1e-2
    )
    contact_approximation: str = quantity(
        "lagged", "", "of the discrete solver", choices=("lagged", "similar", "sap")
    )


@dataclasses.dataclass
class JointImpedanceConfig:
    """Springs in the joints, as KUKA's JointImpedanceControlMode has them.

    KUKA asks for 0 N m/rad or more and a damping of 0 to 1 (iiwa_stack's
    JointImpedanceControlMode.msg); the bounds above are libiiwa's, those below leave
    a spring that holds the bolt. A fresh mode has 1000 N m/rad and 0.7 [from memory].
    """

    stiffness: list[float] = quantity(
        [1000.0, 1000.0, 1000.0, 1000.0, 1000.0, 1000.0, 1000.0], "N m/rad",
        "of each joint, or one for all", low=10.0, high=5000.0, any_length=True,
    )  # fmt: skip
    damping_ratio: float = quantity(0.7, "1", "of each joint", low=0.1, high=1.0)


@dataclasses.dataclass
class CartesianImpedanceConfig:
    """Springs at the bolt along x, y, z of Gn, then about them.

    As KUKA's CartesianImpedanceControlMode has them: 0 to 5000 N/m and 0 to 300
    N m/rad, damping 0.1 to 1, in the null space 0 N m/rad or more and 0.3 to 1
    (iiwa_stack's CartesianImpedanceControlMode.msg; libiiwa has the same bounds). An
    axis without stiffness holds no bolt, so the least is 10 N/m and 1 N m/rad here.
    A fresh mode has 2000 N/m, 200 N m/rad and 0.7 (iiwa_stack's Python client); its
    null space is assumed.
    """

    stiffness: list[float] = quantity(
        [2000.0, 2000.0, 2000.0, 200.0, 200.0, 200.0], "N/m, N m/rad", "at the bolt",
        low=1.0, high=5000.0,
    )  # fmt: skip
    damping_ratio: float = quantity(0.7, "1", "of each axis", low=0.1, high=1.0)
    nullspace_stiffness: float = quantity(
        100.0, "N m/rad", "of each joint, where the bolt does not feel it",
        low=0.0, high=1000.0,
    )  # fmt: skip
    nullspace_damping_ratio: float = quantity(
        0.7, "1", "of that spring", low=0.3, high=1.0
    )


@dataclasses.dataclass
class ArmConfig:
    """The arm and its controller: `stiffness`, `damping_ratio` are position control's.

    The gains of each control: drake_disasm/cell/arm_control.py. `posture` and the
    stiffnesses have a value for each joint, or one for all. An arm of six joints has no
    redundancy: the posture picks one of the ways in which it can hold the bolt.
    """

    model: str = quantity(
        "package://disasm_models/iiwa14/iiwa14.urdf",
        "",
        "URDF of the arm, a path from the scenario's folder or package://",
    )
    name: str = quantity("iiwa", "", "of the device, in `<name>.position` and the like")
    base: str = quantity("iiwa_link_0", "", "link that stands on the world's origin")
    flange: str = quantity(
        "iiwa_link_ee", "", "link that carries the sensor, its z out of the arm"
    )
    joints: list[str] = quantity(
        [], "", "driven ones from base to flange, the model's others held at zero; "
        "empty: all movable ones", any_length=True,
    )  # fmt: skip
    posture: list[float] = quantity(
        [0.0, 0.6, 0.0, -1.4, 0.0, 1.14, 0.0], "rad", "preferred joint angles",
        low=-6.3, high=6.3, any_length=True,
    )  # fmt: skip
    control: str = quantity(
        "position", "", "how the arm is controlled", choices=CONTROLS
    )
    stiffness: list[float] = quantity(
        [20e3, 8e3, 20e3, 8e3, 8e3, 8e3, 8e3], "N m/rad",
        "of each joint, or one for all", low=10.0, high=1e6, any_length=True,
    )  # fmt: skip
    damping_ratio: float = quantity(
        1.0, "1", "of each joint about its own inertia", low=0.1, high=5.0
    )
    joint_impedance: JointImpedanceConfig = dataclasses.field(
        default_factory=JointImpedanceConfig
    )
    cartesian_impedance: CartesianImpedanceConfig = dataclasses.field(
        default_factory=CartesianImpedanceConfig
    )
    control_period: float = quantity(
        0.005, "s", "of the position interface", low=1e-3, high=0.02
    )


@dataclasses.dataclass
class GripperConfig:
    """The gripper and how it holds the bolt.

    `stiffness` is that of adaptive fingers and their rubber pads between palm and
    bolt: springs along and about the axes of the bolt as gripped (x along the groove,
    y out of the plate, z across, along which the fingers close) in the middle of the
    pads. No figure of the real gripper is known; these are assumed, as the ones with
    which the thesis's numbers can be reproduced (docs/explanation/physics.md).

    A tool without driven joints (`fingers: []`), such as a suction cup, holds the bolt
    by these springs at its tcp; commands to open or close it are ignored.
    """

    model: str = quantity(
        "package://disasm_models/gripper_2f140/gripper_2f140.urdf",
        "",
        "URDF with the frames gripper_base and tcp; with fingers also finger_carriage "
        "and fingertip",
    )
    fingers: list[str] = quantity(
        ["left_finger_joint", "right_finger_joint"], "",
        "two sliding joints of the model, at 0 where the pads meet; or none",
        any_length=True,
    )  # fmt: skip
    hold: str = quantity(
        "friction", "", "how fingers hold the bolt", choices=("friction", "weld")
    )
    compliance: str = quantity(
        "adaptive", "", "of the fingers against the palm; adaptive: the springs of "
        "`stiffness`; rigid: none", choices=("adaptive", "rigid"),
    )  # fmt: skip
    stiffness: list[float] = quantity(
        [600.0, 600.0, 600.0, 10.0, 10.0, 10.0], "N/m, N m/rad",
        "of adaptive fingers, or of a tool without fingers",
        low=1.0, high=1e6,
    )  # fmt: skip
    damping_ratio: float = quantity(
        1.0, "1", "of these springs with what they hold", low=0.1, high=5.0
    )
    grip_force: float = quantity(60.0, "N", "on each pad", low=10.0, high=125.0)
    fingertip_gap: float = quantity(
        0.0015,
        "m",
        "between fingertips, or a tool's end, and plate",
        low=0.001,
        high=0.05,
    )
    finger_stiffness: float = quantity(
        3e4, "N/m", "of each finger about its commanded place", low=1e3, high=1e6
    )


@dataclasses.dataclass
class SensorConfig:
    """OnRobot HEX-E: noise and resolution per channel [f; tau] in S."""

    place: str = quantity(
        "wrist", "", "where the wrench is measured: between flange and gripper; under "
        "the fixed part; or none: estimated from the joints' torques, S on the flange",
        choices=("wrist", "part", "none"),
    )  # fmt: skip
    model: str = quantity("package://disasm_models/hex_e/hex_e.urdf", "", "URDF")
    period: float = quantity(0.01, "s", "between samples", low=0.002, high=1.0)
    noise: list[float] = quantity(
        [0.035, 0.035, 0.15, 0.002, 0.002, 0.001], "N, N m", "standard deviation",
        low=0.0, high=10.0,
    )  # fmt: skip
    quantum: list[float] = quantity(
        [1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5], "N, N m", "one count on the wire",
        low=0.0, high=10.0,
    )  # fmt: skip


@dataclasses.dataclass
class PlacementConfig:
    """Where the lock is believed to be: frame Gn, x along the groove, y up."""

    p_WG: list[float] = quantity(
        [0.6, 0.0, 0.22], "m", "point A in the world", low=-1.5, high=1.5
    )
    yaw: float = quantity(0.0, "rad", "of x_G about z_W", low=-3.2, high=3.2)


@dataclasses.dataclass
class RewardConfig:
    """Weights and limits of the reward (thesis, eq. 3.4 and 4.3)."""

    w_dis: float = quantity(1.6, "1/mm", "progress along x", low=0.0, high=100.0)
    w_f: float = quantity(0.3, "1", "force", low=0.0, high=100.0)
    w_t: float = quantity(0.3, "1", "torque", low=0.0, high=100.0)
    w_y: float = quantity(5.0, "1/mm", "lift near the end", low=0.0, high=100.0)
    f_max: float = quantity(20.0, "N", "safety force", low=1.0, high=200.0)
    t_max: float = quantity(5.0, "N m", "safety torque", low=0.1, high=50.0)


@dataclasses.dataclass
class TaskConfig:
    """The Markov decision process."""

    success: str = quantity(
        "removed", "", "what counts as success", choices=("travelled", "removed")
    )
    judged_by: str = quantity(
        "bolt", "", "what a simulation judges `removed` by: where the bolt truly is, "
        "or the readings, as on hardware", choices=("bolt", "readings"),
    )  # fmt: skip
    steps: int = quantity(100, "1", "limit per episode", low=1, high=100000)
    period: float = quantity(0.1, "s", "of one step", low=0.01, high=5.0)
    max_translation: float = quantity(0.003, "m", "per step", low=1e-5, high=0.05)
    max_rotation: float = quantity(0.0174533, "rad", "per step", low=1e-5, high=0.5)
    travel_success: float = quantity(
        0.055,
        "m",
        "way along the first stage (x of a door chain), from which on the second "
        "counts; a turn's at its radius",
        low=0.001,
        high=0.2,
    )
    lift_success: float = quantity(
        0.002, "m", "head's underside above the plate", low=0.0, high=0.05
    )
    room: list[float] = quantity(
        [0.010, 0.008, 0.008], "m", "that the bolt has along x, y, z of G beside its "
        "way from A to the groove's end and out; further away an episode has failed",
        low=0.001, high=0.5,
    )  # fmt: skip
    reward: RewardConfig = dataclasses.field(default_factory=RewardConfig)


@dataclasses.dataclass
class ObservationConfig:
    """How sensor readings become the state (thesis 4.2.4)."""

    variant: str = quantity(
        "exact", "", "of eq. 4.4 to 4.7", choices=("exact", "small_angle")
    )


@dataclasses.dataclass
class Range:
    """A number that each episode draws uniformly (domain randomisation)."""

    parameter: str = quantity("", "", "name, as `GroovePose.ry` or `part.clearance`")
    low: float = quantity(0.0, "", "in the parameter's own unit")
    high: float = quantity(0.0, "", "in the parameter's own unit")


@dataclasses.dataclass
class Scenario:
    """Everything that defines one diagram, or a family of them."""

    name: str = "removal"
    simulation: SimulationConfig = dataclasses.field(default_factory=SimulationConfig)
    part: Part = dataclasses.field(default_factory=DoorChain)
    contact: ContactConfig = dataclasses.field(default_factory=ContactConfig)
    placement: PlacementConfig = dataclasses.field(default_factory=PlacementConfig)
    arm: ArmConfig = dataclasses.field(default_factory=ArmConfig)
    gripper: GripperConfig = dataclasses.field(default_factory=GripperConfig)
    ft_sensor: SensorConfig = dataclasses.field(default_factory=SensorConfig)
    task: TaskConfig = dataclasses.field(default_factory=TaskConfig)
    observation: ObservationConfig = dataclasses.field(
        default_factory=ObservationConfig
    )
    imprecision: float = quantity(0.0, "m", "psi of algorithm 3.2", low=0.0, high=0.01)
    effects: list[Effect] = dataclasses.field(default_factory=list)
    randomisation: list[Range] = dataclasses.field(default_factory=list)
