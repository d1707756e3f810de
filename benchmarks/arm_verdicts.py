"""What closing the loop says of a real arm's motion in which one effect is hidden.

The motion is that of a real arm (`../shared/data/kuka_lwr4`, 12 s); the torque is what
its fitted rigid bodies and the effect predict, and noise that is drawn. Each kind of
effect has its turn, at a joint, in a shape and with signs that are drawn, as large as
the rigid bodies can't take up `--level` times the noise in its worst channel. With
`--friction` every joint has undeclared dry and viscous friction, too, as real arms
have.
"""

import dataclasses
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from answers import (
    Answer,
    Count,
    add_arguments,
    complete,
    no_verdict,
    of_verdict,
    report,
    said,
)
from null_alarms import arm_log, drawn, fitted, noise_of

from drake_disasm.common import options, program
from drake_disasm.common.arrays import Array
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    JointCoulombFriction,
    JointViscousFriction,
    shape_parameters,
)
from drake_disasm.logs import read_logs
from sysid.effect_selection.close_loop import close_loop
from sysid.fitting.candidates import Candidate, candidates, extended
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.identification.noise import with_estimated_noise
from sysid.models import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.parameters import Parameter
from sysid.validation import null_logs
from sysid.workers import Workers

_ROWS = 2400  # of 200 Hz: 12 s
_SEED = 11_000
_ROUNDS = 12  # to the size that is asked for
_CLOSE = 0.05  # of it
_MOST_OF_RANGE = 0.9  # of an amplitude's
_MOST_FIELDS = 2
_NOISE = 0.3  # of what rigid bodies leave of the real torque: without its friction
_PROGRAM = "benchmarks/arm_verdicts.py"
_EXAMPLES = """examples:
  python benchmarks/arm_verdicts.py white --logs 100
  python benchmarks/arm_verdicts.py ar0.9 --level 1 --friction --logs 48
"""


@dataclasses.dataclass(frozen=True)
class Hidden:
    """An effect that was put in.

    Attributes:
        candidate: it, with the amplitudes that are not null.
        model: with it.
        theta: (p,) the model's parameters.
        size: rms that the rigid bodies can't take up, in units of the noise, of the
            channel where it is largest.
    """

    candidate: Candidate
    model: LogModel
    theta: Array
    size: float

    @property
    def text(self) -> str:
        """The values of the effect's parameters."""
        pairs = list(zip(self.model.parameters, self.theta, strict=True))
        own = [p for p in pairs if p[0].name.startswith(f"{self.candidate.name}.")]
        return ", ".join(f"{parameter.name} = {value:.4g}" for parameter, value in own)


def arm(folder: Path) -> LogModel:
    """Returns the model of 12 s of a real arm's motion, with noise as there."""
    model = model_of(read_logs([arm_log(folder)]), ModelChoice())
    model = model.of_rows(np.arange(model.measurements.rows) < _ROWS)
    model = with_estimated_noise(model, Workers(), model.default_huber_delta)
    measured = model.measurements
    less = measured.with_noise(_NOISE * measured.noise, "assumed")
    return model.with_measurements(less)


def with_friction(model: LogModel, theta: Array) -> tuple[LogModel, Array]:
    """Returns a model whose joints rub, and its parameters (p,).

    By once to twice the noise each, dry and in proportion to the rate.
    """
    random = np.random.default_rng(_SEED)
    kinds = candidates(model, [JointCoulombFriction, JointViscousFriction])
    in_one_shape = {candidate.name: candidate for candidate in kinds}
    for candidate in in_one_shape.values():
        model, _ = extended(model, [candidate])
        without, rubs = (model.predictions(np.append(theta, x)) for x in (0.0, 1.0))
        torque = (rubs - without) / model.measurements.noise
        size = np.sqrt(np.mean(torque**2, axis=0)).max()
        theta = np.append(theta, random.uniform(1.0, 2.0) / size)
    return model, theta


def draw(model: LogModel, theta: Array, number: int, level: float) -> Hidden | None:
    """Returns the effect of a case; None if none of its kind shows in this motion.

    Args:
        model: without it.
        theta: (p,) the model's parameters.
        number: of the case, which tells the kind.
        level: the size that is asked for, see `Hidden`.
    """
    random = np.random.default_rng([_SEED, number])
    library = candidates(model)
    kinds = sorted({type(candidate.effect).__name__ for candidate in library})
    kind = kinds[number % len(kinds)]
    own = [c for c in library if type(c.effect).__name__ == kind]
    for place in random.permutation(len(own)):
        found = _of_size(model, theta, own[place], random, level)
        if abs(found.size / level - 1.0) < 2.0 * _CLOSE:
            return found
    return None


def _of_size(
    model: LogModel,
    theta: Array,
    candidate: Candidate,
    random: np.random.Generator,
    level: float,
) -> Hidden:
    """Returns a candidate's effect, as large as it is asked for, or as it may be."""
    count = int(random.integers(1, min(_MOST_FIELDS, len(candidate.fields)) + 1))
    chosen = candidate.only(tuple(random.permutation(candidate.fields)[:count]))
    longer, (new,) = extended(model, [chosen], with_shapes=True)
    own = [longer.parameters[i] for i in new]
    shares = np.array([random.uniform(0.5, 1.0) for _ in own])
    signs = np.array(
        [-1.0 if p.low < p.nominal and random.random() < 0.5 else 1.0 for p in own]
    )
    scale = 1e-3
    for _ in range(_ROUNDS):
        values = [
            _shape(p, candidate, share)
            if p.is_shape
            else float(np.clip(sign * share * scale * p.high, *_within(p.low, p.high)))
            for p, share, sign in zip(own, shares, signs, strict=True)
        ]
        found = np.concatenate([theta, values])
        size = _size(model, longer, found)
        if abs(size / level - 1.0) < _CLOSE:
            break
        scale *= float(np.clip(level / max(size, 1e-9), 0.1, 10.0))
    return Hidden(chosen, longer, found, size)


def _within(low: float, high: float) -> tuple[float, float]:
    return _MOST_OF_RANGE * low, _MOST_OF_RANGE * high


def _shape(parameter: Parameter, candidate: Candidate, share: float) -> float:
    """Returns a value within an effect's grid, on a logarithmic scale if it has one."""
    grid = shape_parameters(type(candidate.effect))[parameter.name.rsplit(".", 1)[1]]
    low = float(np.clip(min(grid), parameter.low, parameter.high))
    high = float(np.clip(max(grid), parameter.low, parameter.high))
    if low <= 0.0:
        return low + (high - low) * share
    return float(np.exp(np.log(low) + np.log(high / low) * share))


def _size(model: LogModel, longer: LogModel, theta: Array) -> float:
    """Returns what the rigid bodies can't take up of an effect, see `Hidden`."""
    measured = model.measurements.with_values(longer.predictions(theta))
    fitter = Fitter(
        model.with_measurements(measured), Workers(), np.inf, DEFAULT_SETTINGS
    )
    residual = fitter.fit(()).linearisation.residual
    return float(np.sqrt(np.mean(residual**2, axis=0)).max())


def answer(
    model: LogModel,
    real: tuple[LogModel, Array],
    noise: null_logs.Noise,
    level: float,
    number: int,
) -> Answer:
    """Returns what closing the loop says of a case's log.

    Args:
        model: of rigid bodies.
        real: the model of the arm without the case's effect, and its parameters.
        noise: is drawn.
        level: of the effect, see `draw`.
        number: of the case.
    """
    hidden = draw(*real, number, level)
    if hidden is None:
        return {"kinds": []} | no_verdict("not visible")
    measured = drawn(hidden.model, hidden.theta, noise, _SEED + number)
    besides = [Candidate.of(effect).name for effect in real[0].effects]
    put_in = {
        "kinds": [hidden.candidate.name, *besides],
        "hidden": hidden.text,
        "size": hidden.size,
    }
    try:
        closed = close_loop(model.with_measurements(measured))
    except DisasmError as error:
        return put_in | no_verdict("refused", str(error))
    return put_in | of_verdict(closed.verdict) | {"text": closed.text}


def _counts(name: str, answers: list[Answer]) -> list[Count]:
    """Returns how often the effects were named."""
    shown = [a for a in answers if a["kinds"]]
    own = [a["kinds"][0] in said(a) for a in shown]
    named = [set(a["kinds"]) <= said(a) for a in shown]
    as_many = [len(a["names"]) == len(a["kinds"]) for a in shown]
    alone = list(map(all, zip(named, as_many, strict=True)))
    rows = (
        ("the case's effect is confirmed, or in an ambiguous set", own),
        ("so is all that is there", named),
        ("the same, and nothing else is named", alone),
    )
    return [Count(name, what, sum(right), shown) for what, right in rows]


def main(arguments: Sequence[str]) -> int:
    """Judges the logs and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument(
        "noise", nargs="+", metavar="NOISE",
        help="white, t3, ar0.9, sieve or a sum, as in null_alarms.py",
    )  # fmt: skip
    parser.add_argument(
        "--level", type=options.above_zero, default=2.0, metavar="X",
        help="size of the effect, times the noise (default: 2)",
    )  # fmt: skip
    parser.add_argument(
        "--friction", action="store_true", help="joints have undeclared friction, too"
    )
    add_arguments(parser, 100, "arm_verdicts")
    args = parser.parse_args(arguments)
    model = arm(args.out / "data")
    real = model, fitted(model)
    real = with_friction(*real) if args.friction else real
    noises = {name: noise_of(name, model) for name in args.noise}
    counts = []
    for name, noise in noises.items():
        path = args.out / f"{name}_{args.level:g}{'_friction' * args.friction}.jsonl"
        to = partial(answer, model, real, noise, args.level)
        counts += _counts(f"arm, {name}", complete(path, args.logs, to))
    title = "Verdicts on a real arm's motion"
    report(counts, title, _PROGRAM, arguments, args.results)
    return 0


if __name__ == "__main__":
    program.run(main)
