"""Do policies that `drake-disasm accept` accepts succeed on the robot?

A sample of the study `twin_transfer`: robots with an effect that the nominal twin
lacks, a log and a verdict of each, policies trained on the nominal and on the corrected
twins. `accept` judges each policy on the corrected twin of the robot that it is for;
then the policy acts on that robot, the simulated cell. After Ctrl-C the same command
goes on.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

from results import Cell, add_results_argument, markdown, write_result

from drake_disasm.common import options, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.statistics import wilson_interval
from drake_disasm.mdp import Outcome
from drake_disasm.studies.runner import open_study, read_test, run_study
from drake_disasm.studies.study import Level, StudyOptions
from sysid.studies.policy_acceptance import read_acceptance
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
    *("robot", "trained on", "judged by", "verdict", "policies"),
    *("succeed on the robot", "95 % interval [%]", "episodes there that succeed"),
)
_EXAMPLES = """examples:
  python benchmarks/acceptance.py --out out/acceptance
  python benchmarks/acceptance.py --results docs/results/data/acceptance.json
"""


class SampleStudy(TwinTransferStudy):
    """The study with less time for each verdict."""

    time_budget = 600.0


def sample(
    study: TwinTransferStudy, folder: Path
) -> Iterator[tuple[dict[str, Level], bool, bool, int, int]]:
    """Yields each policy that a robot has met.

    With its levels, whether the corrected and the nominal twin accept it, and how many
    of its episodes on the robot succeed, of how many.
    """
    for levels in study.combinations():
        for seed in study.options.seeds:
            said = read_acceptance(file_of("accepted", folder, levels, seed))
            test = read_test(file_of("tests", folder, levels, seed))
            if said and test:
                nominal = said["nominal"]["outcome"] == Outcome.SUCCESS.name
                figures = test["successes"], test["episodes"]
                yield levels, said["accepted"], nominal, *figures


def rows(study: TwinTransferStudy, folder: Path) -> list[list[Cell]]:
    """Returns the table: all robots together by each twin's word, then each robot.

    A policy succeeds on the robot if all its episodes there do.
    """
    every = list(sample(study, folder))
    if not every:
        raise DisasmError(f"{folder}: no policy has met a robot yet; run it without --count")
    lines = list[list[Cell]]()

    def add(robot: str, branch: str, twin: str, is_accepted: bool) -> None:
        """Adds the line of what a twin says of some policies, if it says so of any."""
        met = [
            (successes, episodes)
            for levels, corrected, nominal, successes, episodes in every
            if robot in ("all", levels["mismatch"])
            and branch in ("any twin", f"the {levels['branch']} twin")
            and (corrected if twin == "corrected" else nominal) is is_accepted
        ]
        if not met:
            return
        right = sum(s == n for s, n in met)
        low, high = (100.0 * end for end in wilson_interval(right, len(met)))
        said = "accepted" if is_accepted else "refused"
        shares = f"{sum(s for s, _ in met)} of {sum(n for _, n in met)}"
        lines.append(
            [robot, branch, f"the {twin} twin", said, len(met), right]
            + [f"{low:.0f} to {high:.0f}", shares]
        )

    for twin in ("corrected", "nominal"):
        for is_accepted in (True, False):
            add("all", "any twin", twin, is_accepted)
    for robot in study.levels["mismatch"]:
        for branch in study.levels["branch"]:
            for is_accepted in (True, False):
                add(str(robot), f"the {branch} twin", "corrected", is_accepted)
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
    write_result(args.results, title, _COLUMNS, table, _PROGRAM, arguments)
    return 0


if __name__ == "__main__":
    program.run(main)
