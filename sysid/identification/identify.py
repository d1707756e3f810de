"""From a model of a log to its identified parameters, and how certain they are."""

from collections.abc import Mapping, Sequence

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.common.quantity import closest
from sysid.identification.assessment import Assessment
from sysid.identification.journal import Journal
from sysid.identification.noise import with_estimated_noise
from sysid.identification.result import Identification
from sysid.identification.search import Search
from sysid.identification.sensitivity import Sensitivity, sensitivity
from sysid.identification.settings import Settings
from sysid.identification.split import train_and_test
from sysid.models.base import LogModel
from sysid.objective import Objective
from sysid.workers import Workers

#: Share of the episodes that is held out by default.
HELD_OUT_SHARE = 0.25

_THIN_ROWS = (64, 220)  # that a global search and a first descent simulate


def identify(
    model: LogModel,
    *,
    train: Sequence[int] | None = None,
    test: Sequence[int] | None = None,
    settings: Settings | None = None,
    workers: Workers | None = None,
    journal: Journal | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Fits a model to some episodes of its log and evaluates it on the others.

    Two global searches, which check each other, are followed by Gauss-Newton on more
    and more rows; docs/explanation/identification.md has the reasons.

    Args:
        model: of the whole log.
        train, test: numbers of the episodes to fit and of those held out; `test` may
            be empty. If one is omitted, it is all episodes that are not in the other;
            if both are, a quarter of the episodes is held out.
        settings: methods, how they search, and the loss.
        workers: evaluate the model; by default this process.
        journal: keeps what was evaluated, to resume; by default nothing is kept.
        progress: called while it works.

    Raises:
        DisasmError: fewer rows than parameters, or a parameter that the log does not
            determine, unless it is to be frozen.
    """
    settings, workers = settings or Settings(), workers or Workers()
    progress = progress or ignore_progress
    huber_delta = settings.huber_delta_of(model)
    names = model.measurements.names
    train, test = train_and_test(names, train, test, HELD_OUT_SHARE)
    model = with_estimated_noise(model, workers, huber_delta)
    fitted = model.of_episodes(train)
    _refuse_small_logs(fitted)
    _refuse_unknown_profiles(fitted, settings.profiles)
    progress(ProgressUpdate("sensitivities", 0, 1))
    objective = Objective(fitted, workers, huber_delta)
    before = sensitivity(objective, objective.start)
    frozen = _to_freeze(before, fitted, settings)
    model, fitted = model.freeze(frozen), fitted.freeze(frozen)
    objectives = [Objective(m, workers, huber_delta) for m in thinned(fitted)]
    methods = {
        name: Search(name, objectives, settings.search, journal, progress).run()
        for name in settings.methods
    }
    progress(ProgressUpdate("uncertainty", 0, 1))
    held_out = model.of_episodes(test) if test else None
    judge = Objective(held_out, workers, huber_delta) if held_out else None
    assessment = Assessment(objectives[-1], judge, methods)
    wanted = [name for name in settings.profiles if name not in frozen]
    profiles = [assessment.profile(name, workers, progress) for name in wanted]
    notes = list(dict.fromkeys(workers.notes))
    return assessment.result(
        model, frozen, before, profiles, _counts(objectives), notes
    )


def _counts(objectives: Sequence[Objective]) -> tuple[int, int]:
    """Returns how many parameter sets were evaluated, and how many failed."""
    evaluations = sum(each.evaluations for each in objectives)
    return evaluations, sum(len(each.failures) for each in objectives)


def thinned(model: LogModel) -> list[LogModel]:
    """Returns a model of few rows, spread evenly, of more, and of all.

    The last alone if there are few rows, or evaluating them costs nothing.
    """
    steps = [model.measurements.rows // rows for rows in _THIN_ROWS]
    if model.affine:
        return [model]
    return [model.thin(every) for every in steps if every >= 2] + [model]


def _refuse_small_logs(model: LogModel) -> None:
    measured, size = model.measurements, len(model.parameters)
    # Readings at rest are six independent numbers each; a transition mostly repeats
    # the one before.
    known = measured.values.size if model.affine else measured.rows
    if known < size:
        what = "numbers" if model.affine else "transitions"
        raise DisasmError(
            f"the log has {known} {what} to fit and there are {size} parameters; "
            "record more, or name fewer `parameters`"
        )


def _refuse_unknown_profiles(model: LogModel, names: Sequence[str]) -> None:
    known = [p.name for p in model.parameters]
    for name in names:
        if name not in known:
            raise DisasmError(
                f"`profile` {name}: is not fitted; {closest(name, known)}"
            )


def _to_freeze(
    before: Sensitivity, model: LogModel, settings: Settings
) -> Mapping[str, float]:
    """Returns the nominal values of what is not fitted, by name.

    Raises:
        DisasmError: the log does not determine something, and it is not to be frozen.
    """
    if not before.complaints:
        return {}
    if settings.unidentifiable == "stop":
        raise DisasmError(
            "; ".join(before.complaints)
            + "; leave such a parameter out, record motions that excite it, or freeze "
            "it by `unidentifiable` freeze"
        )
    names = before.to_freeze()
    frozen = {p.name: p.nominal for p in model.parameters if p.name in names}
    if len(frozen) == len(model.parameters):
        raise DisasmError(f"nothing is left to fit: {'; '.join(before.complaints)}")
    return frozen
