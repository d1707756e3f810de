"""What an effect is, and the places where one can act.

An effect is one physical phenomenon that the nominal model lacks. It is a dataclass,
so that a scenario can list it (`- !SensorBias {fx: 0.5}`) and identification can fit
its fields. A field is an `amplitude`, which is zero at null, where the effect vanishes
bit for bit; or a `shape_parameter`, a time constant say, which says how the effect
looks and matters only away from null. What it does is a pure function, so that the
simulator, identification and closing the loop share one implementation.

The functions take arrays of any leading shape, in NumPy or torch, and fields that are
arrays (n,) of n environments: `BatchedTwin` refuses an effect whose equation doesn't.
`Effect.vector` and `Effect.column` give fields in such shapes.

To write one: derive a dataclass from the place where it acts (EnvironmentEffect,
MotionEffect, PoseEffect, SensorEffect or JointEffect), give it a docstring and
fields, define the place's method, and put `@register_effect` above it. A model of logs
of one's own may have places of its own: a class derived from Effect, which is given as
`@register_effect(place=...)`.
"""

import abc
import dataclasses
import inspect
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    array_like,
    last_axis,
    to_numpy,
    transposed,
)
from drake_disasm.common.rotations import Pose
from drake_disasm.common.spatial import weight_wrench
from drake_disasm.effects.fields import acts_at_joint, amplitudes, shape_parameters

#: How far back effects on the measured pose may look, all together [s].
LONGEST_POSE_MEMORY = 0.3

#: What an effect on the motion keeps from one step to the next: six numbers.
Memory = Array


@dataclasses.dataclass(frozen=True)
class Environment:
    """The part of the world that can change without rebuilding the diagram.

    Attributes:
        X_GnG: pose of the true groove frame in the groove's nominal frame.
        friction: Coulomb coefficient between bolt and groove (static = dynamic).
        modulus, head_modulus: hydroelastic moduli of the bolt's neck and head [Pa].
        dissipation: Hunt-Crossley dissipation of the contact [s/m].
        clearance: slot width minus neck diameter [m].
        impact_stiffness, impact_exponent: IMPACT's k [N/mm^e] and e.
        force_Gn: (fx, fy, fz) that pulls on the bolt at Bo besides the contact, in
            Gn [N].
        detent: greatest torque of the part's detent [N m].

    Of n environments each number is an array (n,), and the pose a `Pose`.
    """

    X_GnG: RigidTransform | Pose
    friction: float | Array
    modulus: float | Array
    head_modulus: float | Array
    dissipation: float | Array
    clearance: float | Array
    impact_stiffness: float | Array
    impact_exponent: float | Array
    force_Gn: tuple[float | Array, float | Array, float | Array] = (0.0, 0.0, 0.0)
    detent: float | Array = 0.0


@dataclasses.dataclass(frozen=True)
class BoltMotion:
    """What the bolt's surroundings may depend on: its position, its velocity, the time.

    As at the beginning of a step of the MDP; constant for the whole step.

    Attributes:
        p: (..., 3) Bo in Gn [m].
        v: (..., 3) its commanded velocity in Gn [m/s].
        time: (...,) seconds since the episode began.
    """

    p: Array
    v: Array
    time: float | Array = 0.0


#: As an episode starts: at A, at rest.
AT_REST = BoltMotion(np.zeros(3), np.zeros(3))


@dataclasses.dataclass(frozen=True)
class Sensing:
    """The circumstances of readings: what a sensor effect may depend on.

    Of one reading, or of many along leading axes.

    Attributes:
        time: (...,) seconds since the episode (or the log) began.
        R_WS: (..., 3, 3) orientation of the sensor in the world.
        g_W: gravity vector, (3,), or (..., 3) [m/s^2].
        mass: of the payload on the sensor, as the tool data have it [kg]; (..., 1)
            where each reading has its own.
        p_SoScm_S: (3,), or (..., 3), its centre of mass [m].
    """

    time: Array
    R_WS: Array
    g_W: Array
    mass: float | Array = 0.0
    p_SoScm_S: tuple[float, float, float] | Array = (0.0, 0.0, 0.0)

    @property
    def g_S(self) -> Array:
        """Gravity in the sensor's frame, (..., 3) [m/s^2]."""
        return apply_matrix(transposed(self.R_WS), self.g_W)

    @property
    def weight(self) -> Array:
        """The payload's load on the sensor (..., 6), [f; tau] at So in S."""
        p_SoScm_S = array_like(self.p_SoScm_S, self.g_W)
        return weight_wrench(self.mass, p_SoScm_S, self.R_WS, self.g_W)


def name_in_words(name: str) -> str:
    """Returns a class's name as words: "torque offset" of TorqueOffset."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name).lower()


@dataclasses.dataclass(frozen=True)
class Reach:
    """How far a log goes; infinite where that is not known.

    Attributes:
        duration: of its longest episode [s].
        way: of the bolt along x of G, from end to end [m].
        speed: greatest that the bolt is commanded [m/s].
    """

    duration: float = math.inf
    way: float = math.inf
    speed: float = math.inf

    def longer(self, times: float) -> "Reach":
        """Returns that of a log that takes so many times as long."""
        return dataclasses.replace(self, duration=times * self.duration)


@dataclasses.dataclass
class Effect:
    """Base of all effects; see the module's docstring.

    Attributes:
        is_random: whether it acts on the variance alone; models predict the mean.
        is_physical: whether it has a meaning beyond its log: searches try no others.
        is_of_time: whether it depends on time alone, as slow noise seems to.
        is_whole: whether its amplitudes mean something together alone, as a body's.
        noun: what a sentence calls it: "dry friction"; by default its name in words.
        experiment: the recording that shows it apart from others, in words.
        task_experiment: the same in steps of the task, if that is no recording of
            these: readings at rest, say.
        rest_experiment: the same of an arm at rest, if that is a motion.
        experiments_against: what separates it from a rival, by the rival's name; one
            of the two need say it.
    """

    is_random: ClassVar[bool] = False
    is_physical: ClassVar[bool] = True
    is_of_time: ClassVar[bool] = False
    is_whole: ClassVar[bool] = False
    noun: ClassVar[str] = ""
    experiment: ClassVar[str] = ""
    task_experiment: ClassVar[str] = ""
    rest_experiment: ClassVar[str] = ""
    experiments_against: ClassVar[Mapping[str, str]] = {}

    @property
    def is_null(self) -> bool:
        """Whether all its amplitudes are zero: it does nothing."""
        return not any(
            np.any(to_numpy(value)) if getattr(value, "ndim", 0) else value
            for value in (getattr(self, name) for name in amplitudes(type(self)))
        )

    def vector(self, like: Array, *names: str) -> Array:
        """Returns some of its numbers side by side, (k,), or (n, k) of n of them.

        Args:
            like: an array of the kind that is wanted, NumPy's or torch's.
            names: of k fields.
        """
        return last_axis([getattr(self, name) for name in names], like)

    def column(self, name: str) -> float | Array:
        """Returns a number, or (n, 1) of n of them: what scales vectors (..., k)."""
        value = getattr(self, name)
        return value[..., None] if getattr(value, "ndim", 0) else value

    @classmethod
    def places(cls, joints: Sequence[str]) -> list[dict[str, str]]:
        """Returns where it can act: the fields that say so, for each place.

        Args:
            joints: of the arm, or of the model of a log, from the base on.
        """
        return [{"joint": joint} for joint in joints] if acts_at_joint(cls) else [{}]

    @classmethod
    def grids(cls, reach: Reach) -> dict[str, tuple[float, ...]]:
        """Returns values of each shape parameter from which a search starts, by name.

        Args:
            reach: of the log.
        """
        return shape_parameters(cls)

    @classmethod
    def greatest_shapes(cls, reach: Reach) -> dict[str, float]:
        """Returns the greatest values of shape parameters in a log, by name.

        Beyond them it is what another effect is: a step that takes as long as the log
        is a drift.

        Args:
            reach: of the log.
        """
        return {}

    @classmethod
    def description(cls) -> str:
        """Returns what it is, in a line: the first paragraph of its docstring."""
        paragraph = inspect.cleandoc(cls.__doc__ or "").partition("\n\n")[0]
        return " ".join(paragraph.split())

    @classmethod
    def equation(cls) -> str:
        """Returns its equation, from its docstring; empty if that has none."""
        return _docstring_part(cls, "Equation")

    @classmethod
    def place(cls) -> str:
        """Returns where it acts, from its docstring; empty if that does not say."""
        return " ".join(_docstring_part(cls, "Where it acts").split())

    @classmethod
    def in_words(cls) -> str:
        """Returns what a sentence calls it."""
        return cls.noun or name_in_words(cls.__name__)


def _docstring_part(effect: type[Effect], word: str) -> str:
    """Returns what a docstring says after `word:`, up to the next such word."""
    text = inspect.cleandoc(effect.__doc__ or "")
    found = re.search(rf"^{word}: (.*?)(?=^Where it acts: |\Z)", text, re.M | re.S)
    return found.group(1).strip() if found else ""


class EnvironmentEffect(Effect, abc.ABC):
    """Acts on the world around the bolt.

    Attributes:
        is_local: whether it depends on where the bolt is, how fast it goes, or when.
        contact_models: the scenario's `contact.model` in which it acts.
        of_part: name of the part that alone has what it changes.
    """

    is_local: ClassVar[bool] = False
    contact_models: ClassVar[tuple[str, ...]] = ("hydroelastic", "impact")
    of_part: ClassVar[str] = ""

    @abc.abstractmethod
    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Returns the environment with this effect in it."""


class MotionEffect(Effect, abc.ABC):
    """Acts between the pose that is commanded and the one that the arm goes for.

    Both are displacements from the start, (6,) position and rotation vector of B in
    G, at the boundaries of the MDP's steps; between them the velocity is constant.

    Attributes:
        stage: where on the way from command to arm: 0 scale, 1 time, 2 gears,
            3 compliance, 4 scatter.
    """

    stage: ClassVar[int] = 0

    @abc.abstractmethod
    def execute(
        self, commanded: Array, wrench: Array, memory: Memory, period: float
    ) -> tuple[Array, Memory]:
        """Returns what is executed (..., 6), and the memory for the next step.

        Args:
            commanded: (..., 6) for the end of the step [m, rad].
            wrench: (..., 6) [f; tau] on the bolt at Bo in G, measured as the step
                begins.
            memory: (..., 6) of the step before; zeros at the start.
            period: of the MDP [s].
        """


class PoseEffect(Effect, abc.ABC):
    """Acts on the bolt's pose as it is measured, not on the motion itself.

    What is reported is a weighted sum of poses now and before, position and rotation
    vector of B in G, at the boundaries of the MDP's steps, where alone the task reads
    them: a filter with a finite impulse response.
    """

    @abc.abstractmethod
    def weights(self, period: float) -> np.ndarray:
        """Returns the weights (m,) of the pose now, a step ago, and so on.

        Their sum is one.

        Args:
            period: of the MDP [s].
        """


class SensorEffect(Effect, abc.ABC):
    """Acts on what the force/torque sensor reports.

    Attributes:
        stage: where in the chain from load to reading: 0 the load itself, 1 the
            sensor's mounting, 2 its elements, 3 its electronics, 4 its range, 5 what
            happens to readings before they are reported.
            Effects act in this order, whatever the order of a scenario's list.
        present_at_zeroing: whether zeroing the sensor before an episode sees it (a
            load that always hangs there) or not (an error that arises afterwards).
        removed_by_zeroing: whether zeroing removes it altogether, as long as the sensor
            keeps its orientation.
    """

    stage: ClassVar[int] = 3
    present_at_zeroing: ClassVar[bool] = True
    removed_by_zeroing: ClassVar[bool] = False

    @abc.abstractmethod
    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Returns readings with this effect in them.

        Args:
            wrench_S: (..., 6) [f; tau] the load on the sensor at So in S [N, N m].
            sensing: time and orientation of the readings.
        """

    def circumstances(self, sensing: Sensing) -> Sensing:
        """Returns the circumstances that later effects see; the same for most."""
        return sensing


class SensorMemoryEffect(SensorEffect, abc.ABC):
    """A sensor effect that depends on earlier loads.

    The sensor goes from sample to sample: `remember`, then `read`. Readings at rest do
    not show it.

    Attributes:
        memory_size: how many numbers m it remembers.
    """

    memory_size: ClassVar[int] = 6

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Returns readings after a long rest."""
        return wrench_S

    @abc.abstractmethod
    def begin(self, wrench_S: Array) -> Array:
        """Returns the memory (..., m) after a long rest under a load (..., 6)."""

    @abc.abstractmethod
    def remember(self, memory: Array, wrench_S: Array, interval: float) -> Array:
        """Returns the memory (..., m) after a load (..., 6) that held for an interval.

        Args:
            memory: (..., m) before.
            wrench_S: (..., 6) the load now.
            interval: since the sample before [s].
        """

    @abc.abstractmethod
    def read(self, wrench_S: Array, memory: Array) -> Array:
        """Returns the reading (..., 6) of a load with the memory (..., m) up to now."""

    def along(self, wrench_S: Array, times: Array) -> Array | None:
        """Returns the readings (n, 6) of a whole episode, if they are had at once.

        Args:
            wrench_S: (n, 6) the loads, the first of them after a long rest.
            times: (n,) of the loads, in ascending order [s].
        """
        return None


@dataclasses.dataclass(frozen=True)
class JointSamples:
    """Samples of one joint's motion: what an arm's effect may depend on.

    Attributes:
        q, v, vd: (..., n) position, velocity and acceleration [rad, rad/s, rad/s^2].
        load: (..., n) torque that the rigid bodies need there [N m].
    """

    q: np.ndarray
    v: np.ndarray
    vd: np.ndarray
    load: np.ndarray


@dataclasses.dataclass(frozen=True)
class ArmSamples:
    """Samples of the motion of all joints of an arm, in their order.

    Attributes:
        joints: their names.
        q, v, vd: (..., n, joints) [rad, rad/s, rad/s^2]; m instead of rad for a
            prismatic joint.
        load: (..., n, joints) torques that the rigid bodies need [N m], or forces [N].
    """

    joints: tuple[str, ...]
    q: np.ndarray
    v: np.ndarray
    vd: np.ndarray
    load: np.ndarray

    def of(self, joint: str) -> JointSamples:
        """Returns the samples of one joint."""
        i = self.joints.index(joint)
        motion = (a[..., i] for a in (self.q, self.v, self.vd, self.load))
        return JointSamples(*motion)


class ArmEffect(Effect):
    """Acts on an arm, and so on the torques that its joints' sensors measure.

    Attributes:
        is_common: whether an arm that has it at one joint likely has it at the others.
        moves_the_arm: whether it acts on the motion, and not on the readings of torque
            sensors alone.
        needs_both_ways: whether only motion of its joint in both directions can show
            what it is.
        is_dry: whether it depends on the direction of the velocity alone, once that is
            above creeping: at rest it keeps the direction from which its joint came.
    """

    is_common: ClassVar[bool] = True
    moves_the_arm: ClassVar[bool] = True
    needs_both_ways: ClassVar[bool] = False
    is_dry: ClassVar[bool] = False

    @classmethod
    def least_shapes(cls, travel: float) -> dict[str, float]:
        """Returns the least values of shape parameters that a motion can show.

        By name; a smaller one is beyond what the motion could tell from others.

        Args:
            travel: from one end of its joint's motion to the other [rad].
        """
        return {}


class ArmTorqueEffect(ArmEffect, abc.ABC):
    """Adds torques at an arm's joints that depend on the motion of all of them.

    Attributes:
        is_filtered: whether of a filtered motion it gives filtered torques: it is
            linear in the motion, or was learned from such torques.
    """

    is_filtered: ClassVar[bool] = False

    @abc.abstractmethod
    def torques(self, samples: ArmSamples) -> np.ndarray:
        """Returns what it adds to the torques of the rigid bodies, (..., n, joints)."""


class DelayEffect(ArmEffect):
    """Shifts torques in time, against the motion that they belong to.

    Attributes:
        delay: of the torque [s]; negative, if it is the motion that comes late.
    """

    delay: float

    moves_the_arm = False

    @abc.abstractmethod
    def delays(self, joint: str) -> bool:
        """Returns whether the torque of a joint is shifted."""


class JointEffect(ArmTorqueEffect):
    """Acts at one joint of an arm, on the torque that its sensor measures.

    Attributes:
        joint: its name in the URDF.
    """

    joint: str

    def torques(self, samples: ArmSamples) -> np.ndarray:
        """See ArmTorqueEffect."""
        added = np.zeros_like(samples.load)
        own = samples.joints.index(self.joint)
        added[..., own] = self.torque(samples.of(self.joint))
        return added

    @abc.abstractmethod
    def torque(self, samples: JointSamples) -> np.ndarray:
        """Returns what it adds to the torque of the rigid bodies, (..., n) [N m]."""


class JointMemoryEffect(ArmEffect, abc.ABC):
    """Acts at one joint of an arm, by the path on which it came where it is.

    It does not depend on the speed. What it remembers is a number, zero as an episode
    begins.

    Attributes:
        joint: its name in the URDF.
    """

    joint: str

    @abc.abstractmethod
    def remember(self, memory: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Returns the memory after a displacement in one direction.

        Affine in the memory, and the same for a displacement in two parts.

        Args:
            memory: (...) before.
            displacement: (...) of the joint [rad].
        """

    @abc.abstractmethod
    def torque(self, memory: np.ndarray) -> np.ndarray:
        """Returns what it adds to the torque of the rigid bodies, (...) [N m]."""

    def along(self, q: np.ndarray) -> np.ndarray:
        """Returns the memory (n,) along a path (n,) of the joint, from its begin on."""
        dq = np.diff(q)
        to_zero = self.remember(np.zeros_like(dq), dq)
        kept = self.remember(np.ones_like(dq), dq) - to_zero
        steps = zip(kept.tolist(), to_zero.tolist(), strict=True)
        path = itertools.accumulate(steps, lambda m, ab: ab[0] * m + ab[1], initial=0.0)
        return np.fromiter(path, np.float64, len(q))
