"""Which episodes are fitted, and which are held out to judge the fit."""

from collections.abc import Sequence

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest


def train_and_test(
    names: Sequence[str],
    train: Sequence[int] | None,
    test: Sequence[int] | None,
    share: float,
) -> tuple[list[int], list[int]]:
    """Returns the numbers of the episodes to fit and of those held out.

    Args:
        names: of all episodes.
        train, test: what is asked for; one that is None is all that the other leaves.
        share: of the episodes that is held out if both are None.

    Raises:
        DisasmError: nothing is left to fit.
    """
    if train is None and test is None:
        return split_episodes(names, share)
    numbers = range(len(names))
    if train is None:
        train = [i for i in numbers if i not in (test or ())]
    if test is None:
        test = [i for i in numbers if i not in train]
    return list(train), list(test)


def split_episodes(
    names: Sequence[str], held_out: Sequence[str] | float
) -> tuple[list[int], list[int]]:
    """Returns the numbers of the episodes to fit and of those held out.

    Args:
        names: of all episodes, as `log/episode_0003`.
        held_out: a share of them, taken evenly over the log, or names; a name
            of a log stands for all its episodes. One episode is fitted whole.

    Raises:
        DisasmError: no such episode, or nothing is left to fit.
    """
    if isinstance(held_out, float):
        count = round(held_out * len(names)) if len(names) > 1 else 0
        if held_out > 0.0 and len(names) > 1:
            count = min(max(count, 1), len(names) - 1)
        chosen = np.linspace(0, len(names), count, endpoint=False)
        test = {int(i + len(names) / max(count, 1) / 2) for i in chosen}
    else:
        test = {i for word in held_out for i in _matching(names, word)}
    train = [i for i in range(len(names)) if i not in test]
    if not train:
        raise DisasmError("`held_out`: no episode is left to fit; hold out fewer")
    return train, sorted(test)


def _matching(names: Sequence[str], word: str) -> list[int]:
    found = [i for i, n in enumerate(names) if word in (n, n.split("/")[0])]
    if not found:
        logs = sorted({name.split("/")[0] for name in names})
        raise DisasmError(
            f"`held_out` {word}: no such episode; {closest(word, [*logs, *names])}"
        )
    return found
