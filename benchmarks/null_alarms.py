"""How often closing the loop names an effect where none is missing.

The motion or the poses are those of real devices (`../shared/data`); what was measured
is replaced by the model's own prediction and noise that is drawn. Prints how many logs
raise a false alarm, for each noise: white; t3 (Student's t, 3 degrees of freedom);
proportional (to what is predicted); ar0.9 (an autoregression with that correlation from
row to row); sieve (correlated as the real residual); or the sum of two, ar0.98+white.
"""

from collections.abc import Callable, Sequence
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
)
from real_data import write_arm, write_motion, write_static

from drake_disasm.common import program
from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import read_logs
from sysid.effect_selection.close_loop import close_loop
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.identification.noise import with_estimated_noise
from sysid.models import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.measurements import Measurements
from sysid.validation import null_logs
from sysid.workers import Workers

_ARM_ROWS = 600  # of 200 Hz: 3 s
_PROGRAM = "benchmarks/null_alarms.py"
_EXAMPLES = """examples:
  python benchmarks/null_alarms.py static white t3 --logs 200
  python benchmarks/null_alarms.py arm ar0.98 sieve sieve+white --logs 200
"""


def static(folder: Path) -> LogModel:
    """Returns the model of 100 readings of a real sensor at rest."""
    log = folder / "static"
    return _model([log if log.exists() else write_static(100, log)])


def arm_log(folder: Path) -> Path:
    """Returns the log of a real arm's motion, in a folder; written if need be."""
    urdf, log = folder / "arm.urdf", folder / "arm"
    return log if log.exists() else write_motion(1, log, write_arm(urdf))


def arm(folder: Path) -> LogModel:
    """Returns the model of 3 s of a real arm's motion."""
    model = _model([arm_log(folder)])
    return model.of_rows(np.arange(model.measurements.rows) < _ARM_ROWS)


MODELS: dict[str, Callable[[Path], LogModel]] = {"static": static, "arm": arm}


def noise_of(name: str, model: LogModel) -> null_logs.Noise:
    """Returns the noise of a name: white, t3, proportional, ar0.9, sieve; or of two.

    Raises:
        DisasmError: there is no such noise.
    """
    if "+" in name:
        first, second = (noise_of(part, model) for part in name.split("+", 1))
        return null_logs.both(first, second)
    plain = {
        "white": null_logs.white,
        "t3": null_logs.heavy_tailed,
        "proportional": null_logs.in_proportion,
    }
    if name in plain:
        return plain[name]
    if name == "sieve":
        return null_logs.sieve(close_loop(model).last.linearisation.residual)
    try:
        rho = float(name.removeprefix("ar"))
    except ValueError:
        rho = np.nan
    if not abs(rho) < 1.0:
        raise DisasmError(
            f"noise '{name}': unknown; take one of {', '.join([*plain, 'sieve'])}, "
            "ar0.9 with a number below 1, or two of them with +"
        )
    return null_logs.autoregressive(rho)


def fitted(model: LogModel) -> np.ndarray:
    """Returns the parameters (p,) of the log: nominally a sensor carries nothing."""
    fitter = Fitter(model, Workers(), model.default_huber_delta, DEFAULT_SETTINGS)
    return fitter.fit(()).theta


def drawn(
    model: LogModel, theta: np.ndarray, noise: null_logs.Noise, seed: int
) -> Measurements:
    """Returns what a model with parameters (p,) predicts and noise, as if measured.

    How large the noise is they do not say.
    """
    measured = null_logs.null_log(model, noise, seed, theta).measurements
    unknown = np.full(len(measured.channels), np.nan)
    return measured.with_noise(unknown, "unknown")


def answer(model: LogModel, noise: null_logs.Noise, seed: int) -> Answer:
    """Returns what closing the loop says of a null log."""
    measured = drawn(model, fitted(model), noise, seed)
    try:
        found = close_loop(model.with_measurements(measured)).verdict
    except DisasmError as error:
        return {"seed": seed} | no_verdict("refused", str(error))
    return {"seed": seed} | of_verdict(found)


def _model(logs: list[Path]) -> LogModel:
    found = model_of(read_logs(logs), ModelChoice())
    return with_estimated_noise(found, Workers(), found.default_huber_delta)


def main(arguments: Sequence[str]) -> int:
    """Judges null logs and prints the table; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument("model", choices=MODELS, help="whose poses or motion")
    parser.add_argument("noise", nargs="+", metavar="NOISE", help="see above")
    add_arguments(parser, 200, "null_alarms")
    args = parser.parse_args(arguments)
    model = MODELS[args.model](args.out / "data")
    noises = {name: noise_of(name, model) for name in args.noise}
    counts = []
    for name, noise in noises.items():
        path = args.out / f"{args.model}_{name}.jsonl"
        found = complete(path, args.logs, partial(answer, model, noise))
        for key, what in (
            ("names", "an effect is confirmed or ambiguous (false alarm)"),
            ("suggested", "an effect is suggested"),
        ):
            number = sum(bool(each[key]) for each in found)
            counts.append(Count(f"{args.model}, {name}", what, number, found))
    report(counts, "Logs with nothing missing", _PROGRAM, arguments, args.results)
    return 0


if __name__ == "__main__":
    program.run(main)
