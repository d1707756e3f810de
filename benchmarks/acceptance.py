"""Do policies that `drake-disasm accept` accepts succeed on the robot?

A sample of the study `twin_transfer`: robots with an effect that the nominal twin
lacks, a log and a verdict of each, policies trained on the nominal and on the corrected
twins. `accept` judges each policy on the corrected twin of the robot that it is for;
then the policy acts on that robot, the simulated cell. After Ctrl-C the same command
goes on.
"""

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from results import Cell, add_results_argument, markdown, write_result

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.mdp import Outcome
from sysid.studies.policy_acceptance import read_acceptance
from sysid.studies.runner import open_study, read_test, run_study
from sysid.studies.study import StudyOptions
from sysid.studies.twin_transfer import TwinTransferStudy, file_of

_PROGRAM = "benchmarks/acceptance.py"
_LEVELS = {
    "mismatch": ["rolled", "pulled", "biased"],
    "agent": ["ddpg", "sac_layer_norm"],
    "branch": ["nominal", "closed"],
}
_FIRST_SEED = 100  # no other study has it
_EPISODES = 120  # of each training: not all policies have learned then
_COLUMNS = (
    *("robot", "trained on twin", "judged by twin", "twin says", "policies"),
    *("succeed on the robot", "95 % interval [%]", "episodes there that succeed"),
)
_EXAMPLES = """examples:
  python benchmarks/acceptance.py --out out/acceptance
  python benchmarks/acceptance.py --results docs/results/data/acceptance.json
"""


class SampleStudy(TwinTransferStudy):
    """The study with less time for each verdict."""

    time_budget = 600.0


class Met(NamedTuple):
    """A policy that a robot has met.

    Attributes:
        robot: its mismatch.
        branch: "nominal" or "closed", the twin on which the policy was trained.
        corrected, nominal: whether each twin accepts it.
        successes, episodes: on the robot.
    """

    robot: str
    branch: str
    corrected: bool
    nominal: bool
    successes: int
    episodes: int


def sample(study: TwinTransferStudy, folder: Path) -> Iterator[Met]:
    """Yields each policy that a robot has met."""
    for levels in study.combinations():
        for seed in study.options.seeds:
            said = read_acceptance(file_of("accepted", folder, levels, seed))
            test = read_test(file_of("tests", folder, levels, seed))
            if said and test:
                yield Met(
                    str(levels["mismatch"]),
                    str(levels["branch"]),
                    said["accepted"],
                    said["nominal"]["outcome"] == Outcome.SUCCESS.name,
                    int(test["successes"]),
                    int(test["episodes"]),
                )


def row(
    robot: str, branch: str, twin: str, said: str, met: Sequence[Met]
) -> list[Cell]:
    """Returns the line of policies of which a twin says the same.

    A policy succeeds on the robot if all its episodes there do.
    """
    right = sum(m.successes == m.episodes for m in met)
    low, high = (100.0 * end for end in wilson_interval(right, len(met)))
    shares = f"{sum(m.successes for m in met)} of {sum(m.episodes for m in met)}"
    interval = f"{low:.0f} to {high:.0f}"
    return [robot, branch, twin, said, len(met), right, interval, shares]


def rows(study: TwinTransferStudy, folder: Path) -> list[list[Cell]]:
    """Returns the table: all robots by each twin's word, then robot by robot."""
    every = list(sample(study, folder))
    if not every:
        raise DisasmError(f"{folder}: no policy has met a robot; leave out --count")
    lines = []
    for said, is_accepted in (("accepted", True), ("refused", False)):
        for twin in ("corrected", "nominal"):
            met = [m for m in every if getattr(m, twin) is is_accepted]
            if met:
                lines.append(row("all", "either", twin, said, met))
    for robot, branch, said in itertools.product(
        study.levels["mismatch"], study.levels["branch"], ("accepted", "refused")
    ):
        met = [m for m in every if (m.robot, m.branch) == (robot, branch)]
        met = [m for m in met if m.corrected is (said == "accepted")]
        if met:
            lines.append(row(str(robot), str(branch), "corrected", said, met))
    return lines


def main(arguments: Sequence[str]) -> int:
    """Runs the study and counts; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    add = parser.add_argument
    add("--out", type=Path, default=Path("out/acceptance"), metavar="DIR")
    add("--seeds", type=options.positive, default=5, metavar="N", help="(default: 5)")
    add("--count", action="store_true", help="count what is there, and run nothing")
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    study = SampleStudy(
        StudyOptions(
            seeds=tuple(range(_FIRST_SEED, _FIRST_SEED + args.seeds)),
            levels=_LEVELS,
            episodes=_EPISODES,
            overrides=("task.reward.w_f=4",),
            provenance=program.provenance(_PROGRAM, arguments, _FIRST_SEED),
        )
    )
    if not args.count:
        open_study(study, args.out, resume=True)
        with program.ProgressBar("episode", keep=True) as progress:
            run_study(study, args.out, progress=progress)
    table = rows(study, args.out)
    print(markdown(_COLUMNS, table))
    title = "Do policies that the corrected twin accepts succeed on the robot?"
    repeatable = [word for word in arguments if word != "--count"]
    note = "A policy succeeds on the robot (the simulated cell) if both episodes do."
    write_result(args.results, title, _COLUMNS, table, _PROGRAM, repeatable, note)
    return 0


if __name__ == "__main__":
    program.run(main)
