"""How much noise the import's cut-off lets into accelerations, and what it cuts.

Simulates motions of one to four joints, Fourier series or quintic moves with pauses, as
encoders and clocks leave them: rounded, with white noise, some with jitter, at 100 Hz
to 1 kHz. The filter with the chosen cut-off makes accelerations, which are compared
with the true ones. Counted is the worst joint of each motion.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from results import Cell, add_results_argument, markdown, significant, write_result
from tqdm import tqdm

from drake_disasm.common import options
from drake_disasm.common.program import argument_parser, run
from drake_disasm.logs.importing.cutoff import chosen_cutoff, motion_spectra
from drake_disasm.logs.importing.signals import LowPass

Array = NDArray[np.float64]

_NAME = "benchmarks/cutoff_noise.py"
_FIRST = 5800  # seed
_COLUMNS = ("what", "median", "nine of ten below", "most")


def fourier(random: np.random.Generator, t: Array) -> tuple[Array, Array]:
    """Returns a position (n,) of up to eleven harmonics, and its acceleration."""
    base, count = random.uniform(0.05, 0.3), random.integers(3, 12)
    number = np.arange(1, count + 1)
    decay = random.uniform(0.5, 2.0)
    size, w = random.normal(size=count) / number**decay, 2.0 * np.pi * base * number
    waves = size * np.sin(np.outer(t, w) + random.uniform(0.0, 2.0 * np.pi, count))
    return waves.sum(axis=1), -(waves * w**2).sum(axis=1)


def moves(random: np.random.Generator, t: Array) -> tuple[Array, Array]:
    """Returns a position (n,) of quintic moves with pauses, and its acceleration."""
    q, vd = np.zeros_like(t), np.zeros_like(t)
    begin = place = 0.0
    while begin < t[-1]:
        lasts, pause = random.uniform(0.3, 3.0), random.uniform(0.0, 1.0)
        way = 0.6 * lasts * random.normal()
        u = np.clip((t - begin) / lasts, 0.0, 1.0)
        now = (t >= begin) & (t < begin + lasts + pause)
        q[now] = (place + way * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5))[now]
        curve = 60.0 * u - 180.0 * u**2 + 120.0 * u**3
        vd[now] = (way * curve / lasts**2)[now]
        place, begin = place + way, begin + lasts + pause
    return q, vd


def measured(seed: int) -> tuple[Array, Array, float]:
    """Returns measured positions and true accelerations (n, joints), and the period."""
    random = np.random.default_rng(seed)
    period = 1.0 / float(random.choice([100.0, 200.0, 500.0, 1000.0]))
    t = np.arange(0.0, float(random.choice([8.0, 20.0, 50.0])), period)
    kind = (fourier, moves)[int(random.integers(2))]
    quantum, white = (
        10.0 ** random.uniform(-5.5, -3.0),
        10.0 ** random.uniform(-6.5, -4),
    )
    jitter = float(random.choice([0.0, 0.0, 0.05])) * period
    stamped = t + jitter * random.standard_normal(len(t))
    positions, accelerations = [], []
    for _ in range(random.integers(1, 5)):
        q, vd = kind(random, t)
        scale = 10.0 ** random.uniform(-1.0, 0.0)
        read = scale * np.interp(stamped, t, q) + white * random.standard_normal(len(t))
        positions.append(np.round(read / quantum) * quantum)
        accelerations.append(scale * vd)
    return np.stack(positions, axis=1), np.stack(accelerations, axis=1), period


def shares(seed: int) -> tuple[float, float]:
    """Returns noise, as a share of an acceleration's rms, and what is cut of it."""
    q, vd, period = measured(seed)
    low = LowPass(chosen_cutoff(motion_spectra([q], period), period), period)
    passed, inner = low(vd), vd[low.reach : len(vd) - low.reach]
    noise = np.sqrt(np.mean((low(q, 2) - passed) ** 2, axis=0))
    whole = np.sqrt(np.mean(inner**2, axis=0))
    cut = np.sqrt(np.mean((passed - inner) ** 2, axis=0))
    return float(np.max(noise / whole)), float(np.max(cut / whole))


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_NAME}", __doc__, "")
    parser.add_argument(
        "--motions",
        type=options.positive,
        default=60,
        metavar="N",
        help="each with its own noise (default: 60)",
    )
    add_results_argument(parser)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    seeds = range(_FIRST, _FIRST + args.motions)
    found = np.array([shares(seed) for seed in tqdm(seeds, unit="motion", leave=False)])
    rows: list[list[Cell]] = [
        [name, *(significant(float(np.quantile(own, p)), 2) for p in (0.5, 0.9, 1.0))]
        for name, own in zip(("noise", "cut"), found.T, strict=True)
    ]
    print(markdown(_COLUMNS, rows))
    title = "Noise in imported accelerations, as a share of their rms"
    write_result(args.results, title, _COLUMNS, rows, _NAME, arguments, "")
    return 0


if __name__ == "__main__":
    run(main)
