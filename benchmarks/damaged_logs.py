"""Logs that are damaged in one way each."""

import dataclasses
from collections.abc import Callable, Sequence
from types import MappingProxyType

import numpy as np

from drake_disasm.logs import Log

Columns = dict[str, np.ndarray]
Damage = Callable[[Columns], None]


def damaged(log: Log, damage: Damage, episode: int | None = None) -> Log:
    """Returns a log with columns changed, in each episode or one; it stays as it is."""
    episodes = []
    for number, each in enumerate(log.episodes):
        columns = {name: values.copy() for name, values in each.columns.items()}
        if episode in (None, number):
            damage(columns)
        frozen = MappingProxyType(columns)
        episodes.append(dataclasses.replace(each, columns=frozen))
    return dataclasses.replace(log, episodes=tuple(episodes))


def with_episode(log: Log, other: Log, place: int) -> Log:
    """Returns a log with the first episode of another at a place among its own."""
    before, after = log.episodes[:place], log.episodes[place:]
    return dataclasses.replace(log, episodes=(*before, other.episodes[0], *after))


def scaled(factor: float, *names: str) -> Damage:
    """Returns what scales columns; a name ends where that of a column begins."""

    def _damage(columns: Columns) -> None:
        for name in columns:
            if name.startswith(names):
                columns[name] = factor * columns[name]

    return _damage


def changed(
    name: str, rows: slice | list[int], change: Callable[[np.ndarray], np.ndarray]
) -> Damage:
    """Returns what changes some rows of a column."""

    def _damage(columns: Columns) -> None:
        columns[name][rows] = change(columns[name][rows])

    return _damage


def rounded(step: float, *names: str) -> Damage:
    """Returns what rounds columns to whole steps."""

    def _damage(columns: Columns) -> None:
        for name, values in columns.items():
            if name.startswith(names):
                columns[name] = step * np.round(values / step)

    return _damage


def swapped(first: str, second: str, sign: float = 1.0) -> Damage:
    """Returns what exchanges two columns, and maybe turns the sign of both."""

    def _damage(columns: Columns) -> None:
        columns[first], columns[second] = sign * columns[second], sign * columns[first]

    return _damage


def reordered(order: Sequence[int] | np.ndarray) -> Damage:
    """Returns what puts the torques into another order (joints,) of columns."""

    def _damage(columns: Columns) -> None:
        taus = [columns[f"tau.{i}"] for i in order]
        columns.update({f"tau.{i}": tau for i, tau in enumerate(taus)})

    return _damage


def late(rows: int, *names: str) -> Damage:
    """Returns what makes columns late by some rows."""

    def _damage(columns: Columns) -> None:
        for name, values in columns.items():
            if name.startswith(names):
                late = np.roll(values, rows)
                late[:rows] = values[0]
                columns[name] = late

    return _damage


def both(*damages: Damage) -> Damage:
    """Returns what does one damage after the other."""

    def _damage(columns: Columns) -> None:
        for each in damages:
            each(columns)

    return _damage
