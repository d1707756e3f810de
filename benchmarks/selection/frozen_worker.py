"""Answers cases with the selection that is on PYTHONPATH; see `frozen`."""

import dataclasses
import json
import os
import sys
import time
from typing import Any

# What libraries print must not come between the answers.
_ANSWERS = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)

from drake_disasm.common.errors import DisasmError  # noqa: E402
from selection.answer import FAILED, Answer, Case, refusal  # noqa: E402
from selection.current import closed  # noqa: E402
from sysid.effect_selection.settings import DEFAULT_SETTINGS  # noqa: E402


def main() -> None:
    """Reads requests, a line each, until there is none."""
    for line in sys.stdin:
        request = json.loads(line)
        if "defaults" in request:
            found = dataclasses.asdict(DEFAULT_SETTINGS)
        else:
            found = _answered(request).plain
        print(json.dumps(found), file=_ANSWERS, flush=True)


def _answered(request: dict[str, Any]) -> Answer:
    changes = {k: _tupled(v) for k, v in request["settings"].items()}
    settings = dataclasses.replace(DEFAULT_SETTINGS, **changes)
    begin = time.perf_counter()
    try:
        answer = closed(Case(**request["case"]), settings=settings)
    except DisasmError as error:
        answer = refusal(error)
    except Exception as error:  # a selector's failure is a result, too
        answer = Answer("refused", text=f"{FAILED}{type(error).__name__}: {error}")
    return dataclasses.replace(answer, seconds=time.perf_counter() - begin)


def _tupled(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


if __name__ == "__main__":
    main()
