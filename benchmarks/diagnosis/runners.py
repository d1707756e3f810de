"""Runners that the library brings: passive logs, random experiments, and `diagnose`."""

import dataclasses
import itertools
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from diagnosis.answer import Answer
from diagnosis.worlds import World, library
from drake_disasm.experiments import Plan, Removal, registered_experiments
from drake_disasm.experiments.performing import Performance
from sysid.diagnosis import (
    Budget,
    GrowingLog,
    diagnose,
    forecasts_as_it_is,
)
from sysid.diagnosis.station_subject import FIRST


def ours(world: World, folder: Path, seconds: float) -> Answer:
    """Chooses the experiments by what is left."""
    found = diagnose(
        world.model,
        folder,
        real=world.real,
        budget=Budget(seconds),
        effects=library(),
        seed=world.seed,
    )
    performed = [each for each in found.rounds if each.experiment]
    answer = Answer.of(
        found.closed,
        robot_time=found.robot_time,
        experiments=tuple(each.experiment for each in performed),
        force=max((each.force for each in performed), default=0.0),
        torque=max((each.torque for each in performed), default=0.0),
        cut_short=tuple(each.ended for each in performed if each.ended),
    )
    if found.is_refuted:
        return dataclasses.replace(answer, names=(), open=(), is_unknown=True)
    return answer


def passive(world: World, folder: Path, seconds: float) -> Answer:
    """Records removals alone."""

    seeds = itertools.count(world.seed)
    plans = (Removal(seed=seed).plan(world.model) for seed in seeds)
    return _performed(world, folder, seconds, plans)


def by_chance(world: World, folder: Path, seconds: float) -> Answer:
    """Draws experiments that are safe without any effect."""
    return _performed(world, folder, seconds, _drawn(world))


def _drawn(world: World) -> Iterator[Plan]:
    for number in range(FIRST):
        yield Removal(seed=world.seed + number).plan(world.model)
    kinds = [kind for kind in registered_experiments() if kind is not Removal]
    plans = [each.plan(world.model) for kind in kinds for each in kind.variants()]
    plans = [plan for plan in plans if plan.phases]
    known = forecasts_as_it_is(plans, world.model)
    safe = sorted(each.plan.text for each in known if not each.hazard)
    by_text = {plan.text: plan for plan in plans}
    random = np.random.default_rng([world.number, len(safe)])
    while True:
        yield from (by_text[safe[i]] for i in random.permutation(len(safe)))


def _performed(
    world: World, folder: Path, seconds: float, plans: Iterator[Plan]
) -> Answer:
    """Returns what a log of experiments says that go on until the time is over.

    The last one is as long as it is: whoever chooses freely gets a little more.
    """
    shutil.rmtree(folder, ignore_errors=True)
    log = GrowingLog(world.model, folder / "log", real=world.real, seed=world.seed)
    done: list[Performance] = []
    texts = []
    while sum(each.duration for each in done) < seconds:
        plan = next(plans)
        done.append(log.perform(plan))
        texts.append(plan.text)
    closed = log.verdict(library(), fits=folder / "fits")
    return Answer.of(
        closed,
        robot_time=sum(each.duration for each in done),
        experiments=tuple(texts),
        force=max(each.greatest[0] for each in done),
        torque=max(each.greatest[1] for each in done),
        cut_short=tuple(each.ended for each in done if each.ended),
    )
