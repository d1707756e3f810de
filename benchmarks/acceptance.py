"""Do policies that `drake-disasm accept` accepts succeed on the robot?

A sample of the study `twin_transfer`: robots with an effect that the nominal twin
lacks, a log and a verdict of each, policies trained on the nominal and on the corrected
twins. Each is judged on the corrected twin of each robot that it is meant for, and then
acts on that robot, the simulated cell. A run that was stopped goes on.
"""

from collections.abc import Sequence
from pathlib import Path

from results import add_results_argument

from drake_disasm.common import program
from drake_disasm.studies.runner import open_study, run_study
from drake_disasm.studies.study import StudyOptions
from sysid.studies.twin_transfer import TwinTransferStudy

_PROGRAM = "benchmarks/acceptance.py"
_LEVELS = {
    "mismatch": ["rolled", "pulled", "biased"],
    "agent": ["ddpg", "sac_layer_norm"],
    "branch": ["nominal", "closed"],
}
_SEEDS = range(100, 105)  # no other study has these
_EPISODES = 120  # of each training: some policies have not learned then
_EXAMPLES = """examples:
  python benchmarks/acceptance.py --out out/acceptance
"""


class SampleStudy(TwinTransferStudy):
    """The study with less time for each verdict."""

    time_budget = 600.0


def main(arguments: Sequence[str]) -> int:
    """Runs the study and counts; returns the exit status."""
    parser = program.argument_parser(f"python {_PROGRAM}", __doc__, _EXAMPLES)
    parser.add_argument("--out", type=Path, default=Path("out/acceptance"))
    add_results_argument(parser)
    args = parser.parse_args(arguments)
    study = SampleStudy(
        StudyOptions(
            seeds=tuple(_SEEDS),
            levels=_LEVELS,
            episodes=_EPISODES,
            overrides=("task.reward.w_f=4",),
            provenance=program.provenance(f"python {_PROGRAM}", arguments, _SEEDS[0]),
        )
    )
    open_study(study, args.out, resume=True)
    with program.ProgressBar("episode", keep=True) as progress:
        run_study(study, args.out, progress=progress)
    return 0


if __name__ == "__main__":
    program.run(main)
