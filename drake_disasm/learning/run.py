"""One seed's training in a folder: checkpoint, log, policy, result.

::

    folder/
      checkpoint.npz   written after every episode, or every round of them that run at
                       a time; a resumed run continues from it
      log/             every episode (the caller's writer)
      episodes.csv     one row per episode
      policy.npz       the trained policy
      result.json      its figures and its validation; written last
"""

import contextlib
import csv
import dataclasses
import io
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.file_lock import try_lock
from drake_disasm.common.files import make_folder, read_text, write_json, write_text
from drake_disasm.common.plain_data import check_like
from drake_disasm.common.progress import Progress, ProgressUpdate
from drake_disasm.common.text import clipped
from drake_disasm.learning.evaluation import summed_up, validate_policy
from drake_disasm.learning.lockstep import LockstepTrainings
from drake_disasm.learning.policy import trained_policy
from drake_disasm.learning.training import (
    Purpose,
    Recorded,
    Training,
    seed_for,
)
from drake_disasm.mdp import REWARD_TERMS, Outcome
from drake_disasm.policies import save_policy
from drake_disasm.task.episode import EpisodeSummary

_AGAIN = "delete it, and resume the training"
_CHECKPOINT = "checkpoint.npz"
_MOST_BYTES = 2**28
_SHOWN = 20  # latest episodes over which progress is averaged
_PATIENCE = 10.0  # s until the workers of a killed run have noticed


class EpisodeLog(Protocol):
    """Writes the rows of each episode."""

    def write(self, number: int, recorded: Recorded) -> None:
        """Writes episode `number`, if it is not there yet."""


def run_training(
    training: Training,
    folder: Path,
    log: EpisodeLog,
    provenance: dict[str, Any],
    validation: int,
    progress: Progress,
) -> dict[str, Any]:
    """Trains to the end, continuing from the folder's checkpoint if there is one.

    Args:
        training: fresh.
        folder: of this seed.
        log: gets each episode before its checkpoint is written.
        provenance: where the policy is from.
        validation: greedy episodes at the end.
        progress: called after each episode, or each round of them, and each greedy
            one.

    Returns:
        The content of `result.json`.

    Raises:
        DisasmError: another program is training in the folder; a damaged checkpoint.
    """
    make_folder(folder)
    with _locked(folder):
        checkpoint = folder / _CHECKPOINT
        if checkpoint.exists():
            training.restore(checkpoint)
        while len(training.summaries) < training.spec.config.episodes:
            first = len(training.summaries)
            for number, (_, recorded) in enumerate(training.run_episodes(), first):
                log.write(number, recorded)
            training.save(checkpoint)
            progress(_update(training))
        return finish(training, folder, provenance, validation, progress)


def run_in_lockstep(
    trainings: Sequence[Training],
    folders: Sequence[Path],
    logs: Sequence[EpisodeLog],
    progress: Progress,
) -> None:
    """Trains side by side, on a batch of twins, up to the last checkpoint of each.

    `run_training` then finishes each of them.

    Args:
        trainings: fresh.
        folders, logs: of each.
        progress: called after each round of episodes.

    Raises:
        DisasmError: see `run_training`.
    """
    with contextlib.ExitStack() as stack:
        for training, folder in zip(trainings, folders, strict=True):
            make_folder(folder)
            stack.enter_context(_locked(folder))
            if (folder / _CHECKPOINT).exists():
                training.restore(folder / _CHECKPOINT)
        batch = LockstepTrainings(trainings)
        while batch.unfinished:
            for number, recorded in batch.run_episodes().items():
                training = trainings[number]
                logs[number].write(len(training.summaries) - 1, recorded)
                training.save(folders[number] / _CHECKPOINT)
            progress(_update(*trainings))


def _update(*trainings: Training) -> ProgressUpdate:
    """Returns how far online trainings are, and how their latest episodes went."""
    latest = [s for training in trainings for s in training.summaries[-_SHOWN:]]
    won = sum(s.outcome is Outcome.SUCCESS for s in latest)
    return ProgressUpdate(
        "training",
        sum(len(training.summaries) for training in trainings),
        sum(training.spec.config.episodes for training in trainings),
        f"success {won}/{len(latest)}",
        sum(s.reward for s in latest) / len(latest),
    )


def learn_offline(
    training: Training,
    folder: Path,
    updates: int,
    provenance: dict[str, Any],
    validation: int,
    progress: Progress,
) -> dict[str, Any]:
    """Learns from what the training's memory holds, without acting (thesis 3.4.2).

    Args:
        training: fresh, with its dataset.
        updates: gradient updates to do, in as many rounds as there would be episodes.
        folder, provenance, validation, progress: as in `run_training`.
    """
    make_folder(folder)
    parts = training.spec.config.episodes
    with _locked(folder):
        checkpoint = folder / _CHECKPOINT
        if checkpoint.exists():
            training.restore(checkpoint)
        while training.rounds < parts:
            done, next_ = (
                updates * i // parts for i in (training.rounds, training.rounds + 1)
            )
            training.run_round(next_ - done)
            training.save(checkpoint)
            progress(ProgressUpdate("training", training.rounds, parts))
        return finish(training, folder, provenance, validation, progress)


def finish(
    training: Training,
    folder: Path,
    provenance: dict[str, Any],
    validation: int,
    progress: Progress,
) -> dict[str, Any]:
    """Validates the trained policy, and writes policy, episodes and result."""
    spec = training.spec
    seeds = [seed_for(spec.seed, Purpose.VALIDATION, i) for i in range(validation)]
    policy = trained_policy(training, provenance)
    figures = validate_policy(policy, spec.scenario, spec.station, seeds, progress)
    evaluation = dataclasses.asdict(figures)
    description = dataclasses.replace(policy.description, evaluation=evaluation)
    policy = dataclasses.replace(policy, description=description)
    save_policy(folder / "policy.npz", policy)
    write_episodes(folder / "episodes.csv", training.summaries)
    result = _figures(training.summaries) | {
        "seed": spec.seed,
        "updates": training.agent.updates,
        "seconds": training.seconds,
        "validation": evaluation,
    }
    write_json(folder / "result.json", result)
    return result


def _figures(summaries: list[EpisodeSummary]) -> dict[str, Any]:
    """Returns the figures of the training itself; none for an offline one."""
    if not summaries:
        return {}
    won = [i for i, s in enumerate(summaries, 1) if s.outcome is Outcome.SUCCESS]
    return {
        "training": dataclasses.asdict(summed_up(summaries)),
        "first_success": won[0] if won else None,
    }


def write_episodes(path: Path, summaries: list[EpisodeSummary]) -> None:
    """Writes one row per episode as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    plain = [f.name for f in dataclasses.fields(EpisodeSummary)]
    plain = [name for name in plain if name not in ("reward_terms", "outcome")]
    terms = [f"reward.{name}" for name in REWARD_TERMS]
    writer.writerow(["episode", *plain, "outcome", "reward", *terms])
    for number, s in enumerate(summaries):
        row = [number, *(getattr(s, name) for name in plain), s.outcome.label]
        row += [s.reward, *(s.reward_terms.get(name, 0.0) for name in REWARD_TERMS)]
        writer.writerow(row)
    write_text(path, text.getvalue())


def read_episodes(path: Path) -> list[dict[str, Any]]:
    """Returns the rows that `write_episodes` wrote, numbers as numbers.

    Raises:
        DisasmError: the file can't be read, or is damaged.
    """
    text = io.StringIO(read_text(path, _AGAIN, _MOST_BYTES), newline="")
    try:
        rows = [
            {name: _number(cell) for name, cell in row.items()}
            for row in csv.DictReader(text, strict=True)
        ]
        check_like(rows, [{"reward": 0.0, "outcome": ""}])
    except (csv.Error, TypeError, DisasmError) as error:  # a row of another length
        why = clipped(str(error))
        raise DisasmError(f"{path}: is damaged ({why}); {_AGAIN}") from None
    return rows


def _number(text: str) -> Any:
    with contextlib.suppress(ValueError):
        return float(text)
    return text


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Holds the folder for this process; the system lets go when it dies."""
    with (folder / ".lock").open("w") as file:
        until = time.monotonic() + _PATIENCE
        while not try_lock(file):
            if time.monotonic() > until:
                raise DisasmError(
                    f"{folder}: another program is training there; wait for it, or "
                    "give another folder"
                )
            time.sleep(0.1)
        yield
