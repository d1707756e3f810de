"""The package's own selection, as it stands in the tree."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.effects import registered_effects
from drake_disasm.logs import read_logs
from selection.answer import Answer, Case
from selection.watched import watched
from sysid.effect_selection import close_loop
from sysid.fitting.candidates import extended
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models.base import LogModel
from sysid.models.from_logs import ModelChoice, model_of

#: Effects that the package takes for a way in which the log was written.
_EFFECTS = {"CommonDelay": "ArmDelay"}


def select(case: Case) -> Answer:
    """Returns what closing the loop says of a case."""
    return closed(case)


def defaults() -> dict[str, Any]:
    """Returns the default settings, by name."""
    return dataclasses.asdict(DEFAULT_SETTINGS)


def asked(case: Case, settings: Mapping[str, Any]) -> Answer:
    """Returns what closing the loop says of a case with some settings changed."""
    changes: Any = {
        k: tuple(v) if isinstance(v, list) else v for k, v in settings.items()
    }
    return closed(case, settings=dataclasses.replace(DEFAULT_SETTINGS, **changes))


def settings_read(case: Case) -> set[str]:
    """Returns the names of the settings that closing the loop reads for a case."""
    read = set[str]()
    closed(case, settings=watched(DEFAULT_SETTINGS, read))
    return read


def closed(case: Case, **arguments: Any) -> Answer:
    """Returns what closing the loop says of a case.

    Args:
        case: to explain.
        arguments: of `close_loop`, such as settings.
    """
    library = [e for e in registered_effects() if e.__name__ not in case.left_out]
    found = close_loop(_model(case.logs), library=library, **arguments)
    verdict, errors = found.verdict, found.errors
    before, after = errors.relative(errors.before), errors.relative(errors.after)
    if case.held_out and not verdict.written:  # else it was written otherwise, too
        other = _model(case.held_out)
        before, after = (_error(other, fit) for fit in (found.first, found.last))
    return Answer(
        "explained" if verdict.written and verdict.ending == "none" else verdict.ending,
        (*(_EFFECTS.get(w.name, w.name) for w in verdict.written), *verdict.confirmed),
        verdict.suggested,
        {
            name: tuple(part for tie in ties for part in tie.name.split(" and "))
            for name, ties in zip(verdict.names, verdict.ties, strict=True)
            if ties
        },
        {value.name: (value.value, *value.interval) for value in verdict.values},
        before,
        after,
        text=found.sentence,
    )


def _model(folders: tuple[str, ...]) -> LogModel:
    logs = read_logs([Path(folder) for folder in folders])
    return model_of(logs, ModelChoice(fixed=True))


def _error(other: LogModel, fit: Any) -> float:
    """Returns the relative error of a fit on another recording."""
    model, _ = extended(other, fit.effects, with_shapes=True)
    error = (
        model.with_begins(fit.theta).predictions(fit.theta) - other.measurements.values
    )
    return float(np.linalg.norm(error) / np.linalg.norm(other.measurements.values))
