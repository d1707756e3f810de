"""How often closing the loop raises an alarm where nothing is missing.

    python -m tests.sysid.effect_selection.null_alarms static white t3 --logs 200
    python -m tests.sysid.effect_selection.null_alarms arm ar0.98 sieve --logs 200

The motion or the poses are those of real devices (`../shared/data`); what was measured
is replaced by the model's own prediction and noise that is drawn. Writes each answer
to out/null_alarms as it comes, and goes on from there.
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import read_logs
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.settings import DEFAULT_SETTINGS
from sysid.identification.noise import with_estimated_noise
from sysid.models import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.measurements import Measurements
from sysid.validation import null_logs
from sysid.workers import Workers
from tests.sysid.effect_selection.answers import Answer, complete, counted
from tests.sysid.real_data import write_arm, write_motion, write_static

_ARM_ROWS = 600  # of 200 Hz: 3 s


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
    """Returns the noise of a name: white, t3, proportional, ar0.9, sieve; or of two."""
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
    return null_logs.autoregressive(float(name.removeprefix("ar")))


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
        return {"seed": seed, "ending": "refused", "names": [], "text": str(error)}
    return {
        "seed": seed,
        "ending": found.ending,
        "names": list(found.names),
        "text": found.dependence,
    }


def _model(logs: list[Path]) -> LogModel:
    found = model_of(read_logs(logs), ModelChoice())
    return with_estimated_noise(found, Workers(), found.default_huber_delta)


def main() -> None:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", choices=MODELS)
    parser.add_argument(
        "noise", nargs="+", help="white, t3, proportional, ar0.9, sieve, ar0.98+white"
    )
    parser.add_argument("--logs", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("out/null_alarms"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    model = MODELS[args.model](args.out / "data")
    for name in args.noise:
        path = args.out / f"{args.model}_{name}.jsonl"
        answer_to = partial(answer, model, noise_of(name, model))
        found = complete(path, args.logs, answer_to)
        named = sum(bool(each["names"]) for each in found)
        text = counted(f"{args.model}, {name}", "name an effect", named, found)
        print(text, flush=True)


if __name__ == "__main__":
    main()
