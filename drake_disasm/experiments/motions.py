"""The library's experiments."""

import dataclasses
import math
from collections.abc import Iterator

import numpy as np

from drake_disasm.common.quantity import quantity
from drake_disasm.experiments.base import FREE_SPACE, Experiment, speeds, unit
from drake_disasm.experiments.phases import (
    Approach,
    Move,
    Phase,
    Return,
    TakeOut,
    Wait,
    way_back,
)
from drake_disasm.experiments.registry import register_experiment
from drake_disasm.parts import AXES
from drake_disasm.scenario import Scenario

_SHARE = 0.8  # of a stage: short of what is at its end
_HELD = 0.5  # s that a press is held
_NEAR = 0.9  # of a stage, from where on an approach is slow
_CLEAR = 0.01  # m above the part, where the bolt is free to turn


@register_experiment
@dataclasses.dataclass(frozen=True)
class Removal(Experiment):
    """Takes the part out by the classical baseline, with noise on its actions.

    What is recorded before anything is known.
    """

    exploration: float = quantity(1.5e-4, "m", "of the noise", low=0.0, high=5e-4)
    seed: float = quantity(0, "1", "of the noise", low=0, high=1e6)

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        yield TakeOut(scenario, self.exploration, round(self.seed))


@register_experiment
@dataclasses.dataclass(frozen=True)
class Reversals(Experiment):
    """Goes a little way along the first stage and back, again and again.

    Tells apart what keeps its sign (a pull, an offset) from what turns with the motion
    (friction), and play from compliance.
    """

    way: float = quantity(
        0.1, "1", "share of the stage", low=0.02, high=0.8, grid=(0.05, 0.2)
    )
    times: float = quantity(4, "1", "how often", low=1, high=20)
    speed: float = quantity(0.5, "1", "share of the greatest", low=0.05, high=1.0)

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        for _ in range(round(self.times)):
            yield from _there_and_back(scenario, self.way, self.speed)


@register_experiment
@dataclasses.dataclass(frozen=True)
class Strokes(Experiment):
    """Goes along the first stage and back, each time at another speed.

    Tells friction that depends on speed from friction that does not, and a delay from
    a lag.
    """

    way: float = quantity(
        0.3, "1", "share of the stage", low=0.02, high=0.8, grid=(0.1, 0.3)
    )
    slowest: float = quantity(
        0.1, "1", "share of the greatest speed", low=0.02, high=0.5
    )

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        for speed in np.geomspace(1.0, self.slowest, 3):
            yield from _there_and_back(scenario, self.way, float(speed))


@register_experiment
@dataclasses.dataclass(frozen=True)
class Presses(Experiment):
    """Presses the bolt to both sides, at A and farther on.

    Tells gains, cross-talk and mounting of the sensor apart, and where the walls are:
    play from compliance, a turned part from a bent one.
    """

    axis: str = quantity("z", "", "of G, of the force", choices=("z", "y", "v"))
    force: float = quantity(
        3.0, "N", "at which a press is held", low=0.5, high=10.0, grid=(3.0, 6.0)
    )
    places: float = quantity(
        2, "1", "along the first stage", low=1, high=6, grid=(1, 3)
    )

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        axis, stage = AXES.index(self.axis), scenario.part.stages[0]
        if axis == stage.axis:
            return
        ends = np.linspace(0.0, _SHARE * stage.end, round(self.places))
        for end in ends if len(ends) > 1 else [0.0]:
            yield from _to(scenario, float(end), 1.0)
            yield from _press(scenario, axis, self.force, float(end))


@register_experiment
@dataclasses.dataclass(frozen=True)
class RepeatedPresses(Experiment):
    """The same presses twice, with a rest in between.

    Tells what changes with time (drift, warm-up, a drifting gain) from what depends on
    the load.
    """

    rest: float = quantity(
        10.0, "s", "between them", low=1.0, high=120.0, grid=(10.0, 40.0)
    )
    force: float = quantity(3.0, "N", "at which a press is held", low=0.5, high=10.0)

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        axis = _sideways(scenario)
        yield from _press(scenario, axis, self.force, 0.0)
        yield Wait(round(self.rest / scenario.task.period))
        yield from _press(scenario, axis, self.force, 0.0)


@register_experiment
@dataclasses.dataclass(frozen=True)
class LoadedStrokes(Experiment):
    """Presses the bolt to a side, and slides it there and back, fast and slowly.

    Tells one law of friction from another, and from what has its place.
    """

    force: float = quantity(
        3.0, "N", "with which it is pressed", low=0.5, high=10.0, grid=(3.0, 6.0)
    )
    way: float = quantity(0.3, "1", "share of the stage", low=0.02, high=0.8)
    slowest: float = quantity(
        0.1, "1", "share of the greatest speed", low=0.02, high=0.5
    )

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        axis, end = _sideways(scenario), self.way * scenario.part.stages[0].end
        yield Move(unit(axis, 0.25 * _most(scenario, axis)), 40, self.force)
        for share in (1.0, self.slowest):
            for there in _to(scenario, end, share):
                yield there
                yield dataclasses.replace(there, end=0.0, speed=-there.speed)
        yield way_back(np.zeros(6), speeds(scenario), 40)


@register_experiment
@dataclasses.dataclass(frozen=True)
class SlowApproach(Experiment):
    """Goes to the end of the first stage, the last of it slowly, until it is stopped.

    Tells how stiff the contact is from how the bolt is held.
    """

    speed: float = quantity(
        0.1, "1", "share of the greatest", low=0.02, high=0.5, grid=(0.1, 0.3)
    )

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        stage = scenario.part.stages[0]
        yield from _to(scenario, _NEAR * stage.end, 1.0)
        beyond = (1.0 - _NEAR) * stage.end + _most(scenario, stage.axis) * 4
        slow = self.speed * _most(scenario, stage.axis)
        steps = math.ceil(beyond / slow)
        yield Move(unit(stage.axis, slow), steps, 0.75 * stage.effort)
        yield _home(scenario, stage.end)


@register_experiment
@dataclasses.dataclass(frozen=True)
class Rest(Experiment):
    """Waits at A: what drifts by itself."""

    duration: float = quantity(
        20.0, "s", "of it", low=1.0, high=300.0, grid=(20.0, 60.0, 120.0)
    )

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        yield Wait(round(self.duration / scenario.task.period))


@register_experiment
@dataclasses.dataclass(frozen=True)
class Weighing(Experiment):
    """Takes the part out and turns it in free space, both ways about each axis.

    Gravity then has several directions in the sensor: tells a payload from an offset,
    and a gain from either.
    """

    needs = FREE_SPACE
    angle: float = quantity(
        0.2, "rad", "about each axis", low=0.02, high=0.6, grid=(0.1, 0.3)
    )

    def phases(self, scenario: Scenario) -> Iterator[Phase]:
        """See Experiment."""
        last, speed = scenario.part.stages[-1], speeds(scenario)
        clear = last.end + scenario.task.lift_success + _CLEAR
        yield TakeOut(scenario)
        rise = float(speed[last.axis])
        steps = math.ceil(clear / rise)
        yield Approach(last.axis, clear, rise, math.inf, steps)
        for axis in (3, 4, 5):
            steps = max(1, round(self.angle / speed[axis]))
            for sign in (1.0, -2.0, 1.0):
                turn = unit(axis, math.copysign(self.angle / steps, sign))
                yield Move(turn, steps * round(abs(sign)))
                yield Wait(_held(scenario))


def _most(scenario: Scenario, axis: int) -> float:
    return float(speeds(scenario)[axis])


def _sideways(scenario: Scenario) -> int:
    """Returns the axis along which a press meets a wall: z, if that is not the way."""
    return AXES.index("z") if scenario.part.stages[0].axis != AXES.index("z") else 1


def _held(scenario: Scenario) -> int:
    return max(1, round(_HELD / scenario.task.period))


def _to(scenario: Scenario, end: float, share: float) -> Iterator[Approach]:
    """Yields the way along the first stage to somewhere, at a share of the speed."""
    stage = scenario.part.stages[0]
    if end <= 0.0:
        return
    speed = share * _most(scenario, stage.axis)
    steps = math.ceil(2.0 * end / speed)
    yield Approach(stage.axis, end, speed, stage.effort, steps)


def _home(scenario: Scenario, away: float, share: float = 1.0) -> Return:
    """Returns the way back to A from somewhere along the first stage."""
    speed = share * speeds(scenario)
    steps = 2.0 * away / speed[scenario.part.stages[0].axis]
    return way_back(np.zeros(6), speed, steps)


def _there_and_back(scenario: Scenario, way: float, share: float) -> Iterator[Phase]:
    end = way * scenario.part.stages[0].end
    yield from _to(scenario, end, share)
    yield _home(scenario, end, share)


def _press(scenario: Scenario, axis: int, force: float, end: float) -> Iterator[Phase]:
    """Yields presses to both sides, held, from somewhere along the first stage.

    A press about an axis is held at the torque of that force at 2 cm.
    """
    most, speed = _most(scenario, axis), speeds(scenario)
    effort = force if axis < 3 else 0.02 * force
    place = np.zeros(6)
    place[scenario.part.stages[0].axis] = end
    steps = 40
    for sign in (1.0, -1.0):
        yield Move(unit(axis, sign * 0.25 * most), steps, effort)
        yield Wait(_held(scenario))
        yield way_back(place, speed, steps)
