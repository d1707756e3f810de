"""Answers cases with the selection that is on PYTHONPATH; see `frozen`.

It speaks to the package as it was at that commit, and so shares nothing with `current`.
"""

import dataclasses
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

# What libraries print must not come between the answers.
_ANSWERS = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)

import numpy as np  # noqa: E402

from drake_disasm.common.errors import DisasmError  # noqa: E402
from drake_disasm.effects import registered_effects  # noqa: E402
from drake_disasm.logs import read_logs  # noqa: E402
from selection.answer import FAILED, Answer, Case, refusal  # noqa: E402
from selection.watched import watched  # noqa: E402
from sysid.effect_selection.close_loop import close_loop  # noqa: E402
from sysid.fitting.candidates import extended  # noqa: E402
from sysid.fitting.settings import DEFAULT_SETTINGS  # noqa: E402
from sysid.models.from_logs import ModelChoice, model_of  # noqa: E402


def main() -> None:
    """Reads requests, a line each, until there is none."""
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(_reply(request)), file=_ANSWERS, flush=True)


def _reply(request: dict[str, Any]) -> Any:
    """Returns an answer, the names of settings read for it, or the default settings."""
    if "case" not in request:
        return _defaults()
    if request["settings"] is not None:
        return _answered(request["case"], request["settings"]).plain
    read = set[str]()
    _answered(request["case"], {}, watched(DEFAULT_SETTINGS, read))
    return sorted(read)


def _defaults() -> dict[str, Any]:
    return dataclasses.asdict(DEFAULT_SETTINGS)


def _answered(
    case: dict[str, Any], changes: dict[str, Any], settings: Any = DEFAULT_SETTINGS
) -> Answer:
    begin = time.process_time()
    try:
        answer = _closed(Case(**case), changes, settings)
    except DisasmError as error:
        answer = refusal(error)
    except Exception as error:  # a selector's failure is a result, too
        answer = Answer("refused", text=f"{FAILED}{type(error).__name__}: {error}")
    return dataclasses.replace(answer, seconds=time.process_time() - begin)


def _closed(case: Case, given: dict[str, Any], settings: Any) -> Answer:
    """Returns the verdict: all names are confirmed, ties are ambiguous sets."""
    changes: Any = {k: tuple(v) if isinstance(v, list) else v for k, v in given.items()}
    library = [e for e in registered_effects() if e.__name__ not in case.left_out]
    found = close_loop(
        _model(case.logs),
        library=library,
        settings=dataclasses.replace(settings, **changes) if changes else settings,
    )
    verdict, errors = found.verdict, found.errors
    before, after = errors.relative(errors.before), errors.relative(errors.after)
    if case.held_out:
        other = _model(case.held_out)
        before, after = (_error(other, fit) for fit in (found.first, found.last))
    ties = {
        name: tuple(part for tie in own for part in tie.name.split(" and "))
        for name, own in zip(verdict.names, verdict.ties, strict=True)
        if own
    }
    sizes = {value.name: (value.value, *value.interval) for value in verdict.values}
    text = found.sentence
    return Answer(
        verdict.ending, verdict.names, (), ties, sizes, before, after, text=text
    )


def _model(folders: Sequence[str]) -> Any:
    logs = read_logs([Path(folder) for folder in folders])
    return model_of(logs, ModelChoice(fixed=True))


def _error(other: Any, fit: Any) -> float:
    """Returns the relative error of a fit on another recording."""
    model: Any = extended(other, fit.effects, with_shapes=True)[0]
    measured = other.measurements.values
    error = model.begun(fit.theta).predictions(fit.theta) - measured
    return float(np.linalg.norm(error) / np.linalg.norm(measured))


if __name__ == "__main__":
    main()
