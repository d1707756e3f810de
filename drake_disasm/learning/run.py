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
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.file_lock import try_lock
from drake_disasm.common.files import make_folder, read_text, write_json, write_text
from drake_disasm.common.plain_data import check_like
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.common.text import clipped
from drake_disasm.learning.actor_critic import ActorCritic
from drake_disasm.learning.environments import Environments
from drake_disasm.learning.evaluation import summed_up, validate_policy
from drake_disasm.learning.loop import Ended, TrainingLoop
from drake_disasm.learning.policy import trained_policy
from drake_disasm.learning.random_numbers import Purpose, seed_for
from drake_disasm.learning.training import Training, TrainingSpec
from drake_disasm.logs import LogWriter, flat_columns
from drake_disasm.mdp import REWARD_TERMS, Outcome
from drake_disasm.policies import save_policy
from drake_disasm.task.episode import EpisodeSummary

_AGAIN = "delete it, and resume the training"
_CHECKPOINT = "checkpoint.npz"
_MOST_BYTES = 2**28
_SHOWN = 20  # latest episodes over which progress is averaged
_PATIENCE = 10.0  # s until the workers of a killed run have noticed


def run_trainings(
    trainings: Sequence[Training],
    make: Callable[[], Environments | None],
    folders: Sequence[Path],
    logs: Sequence[LogWriter] = (),
    progress: Progress = ignore_progress,
) -> None:
    """Trains to the end, continuing from the folders' checkpoints where there are any.

    Args:
        trainings: fresh.
        make: makes the environments, see `TrainingLoop`; not called if all is done.
        folders: of each.
        logs: of each, or none; get its episodes before their checkpoint is written.
        progress: called after each round.

    Raises:
        DisasmError: another program is training in a folder; a damaged checkpoint.
    """
    with contextlib.ExitStack() as stack:
        for training, folder in zip(trainings, folders, strict=True):
            make_folder(folder)
            stack.enter_context(_locked(folder))
            if (folder / _CHECKPOINT).exists():
                training.restore(folder / _CHECKPOINT)
        if all(training.is_finished for training in trainings):
            return
        loop = TrainingLoop(make(), trainings)
        while loop.unfinished:
            for number, ended in loop.run_round().items():
                if logs:
                    _write(logs[number], trainings[number], ended)
                trainings[number].save(folders[number] / _CHECKPOINT)
            progress(_update(trainings))


def _write(log: LogWriter, training: Training, ended: Ended) -> None:
    """Writes episodes, unless a run that was killed had written them."""
    first = len(training.summaries) - len(ended)
    for number, (_, columns) in enumerate(ended, first):
        if columns is not None and number >= log.next_number:
            log.write_episode(flat_columns("transitions", columns))


def _update(trainings: Sequence[Training]) -> ProgressUpdate:
    """Returns how far trainings are, and how their latest episodes went."""
    done = sum(training.done for training in trainings)
    total = sum(training.config.episodes for training in trainings)
    latest = [s for training in trainings for s in training.summaries[-_SHOWN:]]
    if not latest:
        return ProgressUpdate("training", done, total)
    won = sum(s.outcome is Outcome.SUCCESS for s in latest)
    reward = sum(s.reward for s in latest) / len(latest)
    note = f"success {won}/{len(latest)}"
    return ProgressUpdate("training", done, total, note, reward)


def finish(
    training: Training,
    spec: TrainingSpec,
    folder: Path,
    provenance: dict[str, Any],
    validation: int,
    progress: Progress,
) -> dict[str, Any]:
    """Validates a trained policy, and writes policy, episodes and result.

    Args:
        training: at its end.
        spec: of it.
        folder: of the seed.
        provenance: where the policy is from.
        validation: greedy episodes of each task.
        progress: called after each of them.

    Returns:
        The content of `result.json`.
    """
    seeds = [seed_for(spec.seed, Purpose.VALIDATION, i) for i in range(validation)]
    assert isinstance(training.agent, ActorCritic)  # what a spec makes
    policy = trained_policy(training.agent.network(), spec, provenance)
    figures = validate_policy(policy, spec.scenarios, spec.station, seeds, progress)
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
    rows = [_row(number, summary) for number, summary in enumerate(summaries)]
    names = list(_row(0, EpisodeSummary(0)))
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())


def _row(number: int, s: EpisodeSummary) -> dict[str, Any]:
    plain = dataclasses.asdict(s)
    for name in ("reward_terms", "outcome"):
        del plain[name]
    terms = {f"reward.{name}": s.reward_terms.get(name, 0.0) for name in REWARD_TERMS}
    whole = {"outcome": s.outcome.label, "reward": s.reward}
    return {"episode": number} | plain | whole | terms


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
