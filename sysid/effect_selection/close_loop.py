"""From a model of a log to the effect that the model lacks."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from drake_disasm.effects import Effect, Imprecision, registered_effects
from drake_disasm.scenario import Scenario
from sysid.effect_selection.candidates import candidates
from sysid.effect_selection.command_scatter import Scatter, scatter
from sysid.effect_selection.data_sufficiency import refuse_few_rows, refuse_short_logs
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.held_out import HeldOut, held_out
from sysid.effect_selection.search import Round, Survey, Tracer
from sysid.effect_selection.verdict import Verdict, verdict
from sysid.identification.noise import with_estimated_noise
from sysid.models.base import LogModel
from sysid.workers import Workers

#: As models of transitions have them; ask the model instead.
HELD_OUT, HUBER = 0.25, 3.0
_SEARCHED = 250  # rows, of a model whose evaluation takes seconds


@dataclass(frozen=True)
class Closed:
    """What closing the loop found.

    Attributes:
        verdict: the answer.
        first, last: the model fitted without and with the effects.
        rounds: how the effects were chosen.
        begin, end: what spoke for each candidate before the first and after the last.
        errors: before and after, on rows that were not fitted.
        scatter: about the commands, if the arm has that.
    """

    verdict: Verdict
    first: Fit
    last: Fit
    rounds: tuple[Round, ...]
    begin: Survey
    end: Survey
    errors: HeldOut
    scatter: Scatter | None

    @property
    def scenario(self) -> Scenario | None:
        """What was identified, with the effects that were found; None without one."""
        scenario = self.last.model.scenario_at(self.last.theta)
        if self.scatter is None or scenario is None:
            return scenario
        more = Imprecision(*self.scatter.std.tolist())
        return dataclasses.replace(scenario, effects=[*scenario.effects, more])


def close_loop(
    model: LogModel,
    train: Sequence[int],
    test: Sequence[int],
    huber_delta: float,
    workers: Workers,
    tell: Callable[[str], None],
    library: Sequence[type[Effect]] | None = None,
    folder: Path | None = None,
) -> Closed:
    """Finds what a model lacks to explain its log.

    Args:
        model: of the whole log, with the parameters that are identified anyway.
        train, test: numbers of its episodes; `test` may be empty: contiguous blocks
            are then held out in turn.
        huber: where squares end, in units of the noise.
        workers: to evaluate with.
        tell: called with a line after each step.
        library: effects that may be named; by default all that are registered.
        folder: where fits are kept: the same search, stopped and begun again, takes
            them from there.

    Raises:
        DisasmError: the log is too short to decide anything.
    """
    base = with_estimated_noise(model.of_episodes(train), workers, huber_delta)
    refuse_few_rows(base)
    library = registered_effects() if library is None else library
    library_here = candidates(base, library)
    tracer = Tracer(
        _affordable(base), library_here, workers, huber_delta, tell, folder=folder
    )
    tell("the model as it is")
    first = tracer.fit(())
    tell(f"objective {first.value:.4g}; asking {len(library_here)} candidates")
    begin = tracer.survey(first)
    last, end = tracer.forward(first, begin)
    if tracer.base is not base:
        tell("once more with all rows")
        tracer, first, last = _with_all_rows(tracer, base, last)
    refuse_short_logs(last)
    kept = _like(base, model.of_episodes(test)) if test else None
    errors = held_out(tracer, first, last, kept)
    loose = scatter(last, workers, huber_delta) if Imprecision in library else None
    found = verdict(tracer, first, last, end, errors, loose)
    rounds = tuple(tracer.rounds)
    return Closed(found, first, last, rounds, begin, end, errors, loose)


def _affordable(base: LogModel) -> LogModel:
    """Returns the model of so many rows that hundreds of evaluations are affordable."""
    every = round(base.measurements.rows / _SEARCHED)
    if not base.costly or every < 2:
        return base
    return base.thin(every)


def _with_all_rows(
    tracer: Tracer, base: LogModel, last: Fit
) -> tuple[Tracer, Fit, Fit]:
    """Returns the fits without and with the effects to what was thinned for the search.

    The last has the model's own derivatives; and the tracer that fits so.
    """
    tracer = dataclasses.replace(tracer, base=base, exact=True)
    return tracer, tracer.fit(()), tracer.fit(last.effects, last)


def _like(base: LogModel, test: LogModel) -> LogModel:
    """Returns the rows that were kept, with the noise that the fitted ones tell."""
    noise = base.measurements.noise
    origin = base.measurements.channels[0].origin
    return test.with_measurements(test.measurements.with_noise(noise, origin))
