"""What an experiment says of itself, for every user of it.

An experiment is a frozen dataclass whose fields are its parameters. To write one:
derive from `Experiment`, or from `JointExperiment` for an arm in free space, give it
fields by `drake_disasm.common.quantity`, and put `@register_experiment` above it.
"""

import abc
import dataclasses
import itertools
from collections.abc import Iterable
from typing import ClassVar, Self

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.experiments.phases import Phase
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.mdp import action_bounds
from drake_disasm.scenario import Scenario

#: What an experiment may need beside contact.
FREE_SPACE = "free space"


@dataclasses.dataclass(frozen=True)
class Plan:
    """An experiment on a scenario: what is done, one phase after the other.

    Attributes:
        experiment: with its parameters.
        phases: in their order.
        period: of a step [s].
    """

    experiment: "Experiment"
    phases: tuple[Phase, ...]
    period: float

    @property
    def most_steps(self) -> int:
        """After which it is over in any case."""
        return sum(phase.most_steps for phase in self.phases)

    @property
    def text(self) -> str:
        """The experiment with its parameters."""
        return self.experiment.text


@dataclasses.dataclass(frozen=True)
class AnyExperiment:
    """A motion that tells effects apart, with its parameters."""

    @property
    def text(self) -> str:
        """The name with its parameters."""
        return repr(self)

    def refuse_out_of_bounds(self) -> None:
        """Raises DisasmError for a parameter that is out of bounds."""
        for field in dataclasses.fields(self):
            low, high = field.metadata["low"], field.metadata["high"]
            value = getattr(self, field.name)
            if not isinstance(value, str) and not low <= value <= high:
                raise DisasmError(
                    f"{type(self).__name__}.{field.name}: {value:g} is not within "
                    f"{low:g} and {high:g}"
                )

    @classmethod
    def variants(cls) -> list[Self]:
        """Returns it with all combinations of what its fields' grids say."""
        fields = dataclasses.fields(cls)
        grids = [f.metadata["grid"] or f.metadata["choices"] for f in fields]
        grids = [g or (f.default,) for g, f in zip(grids, fields, strict=True)]
        names = [field.name for field in fields]
        return [
            cls(**dict(zip(names, values, strict=True)))
            for values in itertools.product(*grids)
        ]


@dataclasses.dataclass(frozen=True)
class Experiment(AnyExperiment, abc.ABC):
    """A motion of the bolt, from A on.

    Attributes:
        needs: "" for contact alone, or FREE_SPACE.
    """

    needs: ClassVar[str] = ""

    @abc.abstractmethod
    def phases(self, scenario: Scenario) -> Iterable[Phase]:
        """Returns what is done on a scenario, from where an episode begins.

        Raises:
            DisasmError: the scenario has nothing to do it with.
        """

    def plan(self, scenario: Scenario) -> Plan:
        """Returns the experiment on a scenario.

        Raises:
            DisasmError: a parameter is out of bounds, or the scenario has nothing to do
                it with.
        """
        self.refuse_out_of_bounds()
        return Plan(self, tuple(self.phases(scenario)), scenario.task.period)


@dataclasses.dataclass(frozen=True)
class JointExperiment(AnyExperiment, abc.ABC):
    """A motion of an arm's joints in free space, from home and back."""

    @abc.abstractmethod
    def motion(self, space: ArmSpace) -> MotionTable:
        """Returns the motion, within the joints' limits.

        Whoever calls it looks for collisions, and makes it smaller.
        """

    def plan(self, space: ArmSpace) -> "JointPlan":
        """Returns the experiment in a space, small enough for it.

        Raises:
            DisasmError: a parameter is out of bounds.
        """
        self.refuse_out_of_bounds()
        return JointPlan(self, space.fitted(self.motion(space)))


@dataclasses.dataclass(frozen=True)
class JointPlan:
    """An experiment in free space.

    Attributes:
        experiment: with its parameters.
        motion: that is played.
    """

    experiment: JointExperiment
    motion: MotionTable

    @property
    def text(self) -> str:
        """The experiment with its parameters."""
        return self.experiment.text


def speeds(scenario: Scenario) -> np.ndarray:
    """Returns the largest action (6,) of a scenario's task [m, rad]."""
    return action_bounds(scenario.task)


def unit(axis: int, length: float) -> tuple[float, ...]:
    """Returns the action (6,) of a length along or about an axis of G."""
    action = np.zeros(6)
    action[axis] = length
    return tuple(action.tolist())
