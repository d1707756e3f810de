"""Whether the way of recording changes the verdict: rate, stamps, lost messages.

Simulates an arm of three joints with friction, and writes bags of the same motion: at
1 kHz, at 100 Hz, with stamps of arrival (late by 2 ms in the mean), and with 2 % of the
messages lost. Each is imported and judged. Prints the names that are confirmed, and how
far sizes are off the truth.
"""

import argparse
import dataclasses
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from filtered_intervals import EFFECTS, JOINTS, imported, recording, write_arm
from numpy.typing import NDArray
from results import Cell, add_results_argument, markdown, write_result
from tqdm import tqdm

from drake_disasm.common import options
from drake_disasm.common.program import argument_parser, run
from drake_disasm.logs.importing.importer import low_pass_of
from drake_disasm.stations.fake_cell.bag import FakeBag
from sysid.effect_selection import close_loop
from sysid.effect_selection.verdict import Verdict
from sysid.models.from_logs import ModelChoice, model_of

Array = NDArray[np.float64]

_NAME = "benchmarks/recording_variants.py"
_LATE = 0.002  # s, of stamps of arrival: an exponential distribution's mean
_APART = 2e-5  # s, of messages that arrive together
_LOST = 0.02
_COLUMNS = ("seed", "recorded", "cut-off [Hz]", "confirmed", "sizes with the truth")


@dataclasses.dataclass(frozen=True)
class Variant:
    """One way of recording.

    Attributes:
        period: between rows [s].
        stamps: of rows sampled at times (n,), from a generator of random numbers.
        lost: share of the messages that is lost.
    """

    period: float
    stamps: Callable[[np.random.Generator, Array], Array] = lambda _, time: time
    lost: float = 0.0


def _of_arrival(random: np.random.Generator, time: Array) -> Array:
    """Returns when rows arrive, none before the one that was sampled before it."""
    apart = _APART * np.arange(len(time))
    late = time + random.exponential(_LATE, len(time))
    return np.asarray(np.maximum.accumulate(late - apart) + apart)


VARIANTS: Mapping[str, Variant] = {
    "1 kHz": Variant(0.001),
    "100 Hz": Variant(0.01),
    "500 Hz": Variant(0.002),
    "500 Hz, stamps of arrival": Variant(0.002, _of_arrival),
    "500 Hz, 2 % lost": Variant(0.002, lost=_LOST),
}


@dataclasses.dataclass(frozen=True)
class Judged:
    """What is said of one bag.

    Attributes:
        cutoff: of the import [Hz].
        verdict: on it.
    """

    cutoff: float
    verdict: Verdict

    @property
    def names(self) -> frozenset[str]:
        """Of confirmed effects."""
        return frozenset(self.verdict.names)

    def covered(self) -> dict[str, bool]:
        """Whether intervals hold the true sizes, of confirmed effects that are real."""
        truth = {f"{type(e).__name__}.{getattr(e, 'joint', '')}": e for e in EFFECTS}
        found = {}
        for value in self.verdict.values:
            name, _, field = value.name.rpartition(".")
            if name in truth and name in self.names:
                exact = getattr(truth[name], field)
                low, high = value.interval
                found[value.name] = low <= exact <= high
        return found


def judged(variant: Variant, seed: int, folder: Path) -> Judged:
    """Returns what is said of a recording.

    Args:
        variant: how it is recorded.
        seed: of motion, noise, stamps and losses.
        folder: for the bag and the log; empty.
    """
    urdf = write_arm(folder / "arm.urdf")
    time, q, tau = recording(urdf, seed, variant.period)
    random, bag = np.random.default_rng(seed), FakeBag()
    stamps = variant.stamps(random, time)
    for number in np.flatnonzero(random.random(len(time)) >= variant.lost):
        bag.add_joint_state(stamps[number], JOINTS, q[number], tau[number])
    bag.write(folder / "bag")
    log = imported(folder / "bag", urdf, folder / "log", None)
    low = low_pass_of(log.header)
    assert low is not None
    model = model_of([log], ModelChoice(urdf=str(urdf)))
    return Judged(low.cutoff, close_loop(model).verdict)


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = argument_parser(f"python {_NAME}", __doc__, "")
    parser.add_argument(
        "--seeds",
        type=options.positive,
        default=5,
        metavar="N",
        help="motions, each recorded in every way (default: 5)",
    )
    add_results_argument(parser)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    rows: list[list[Cell]] = []
    todo = [(seed, name) for seed in range(args.seeds) for name in VARIANTS]
    for seed, name in tqdm(todo, unit="log", leave=False):
        with tempfile.TemporaryDirectory() as folder:
            found = judged(VARIANTS[name], seed, Path(folder))
        covered = found.covered()
        inside = f"{sum(covered.values())} of {len(covered)}"
        names = ", ".join(sorted(found.names))
        rows.append([seed, name, f"{found.cutoff:.3g}", names, inside])
    print(markdown(_COLUMNS, rows))
    title = "The same motion, recorded in other ways"
    write_result(args.results, title, _COLUMNS, rows, _NAME, arguments, "")
    return 0


if __name__ == "__main__":
    run(main)
