"""Compares how agents learn in a stand-in for the robot (thesis, table 4.3).

One agent is trained on the twin as first identified, one on the twin after closing the
loop, one is untrained; all are then trained in the stand-in, which is simulated, too,
and has effects that the first twin lacks. P is the mean episodic reward over the
training there. Every training is one of tools/train.py, in a folder of its own within
--out. A study that was interrupted continues with --resume.
"""

import argparse
import dataclasses
import os
from collections.abc import Callable, Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # processes work in parallel, not threads

import cli

from drake_disasm.common import options, program
from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.progress import Progress
from drake_disasm.learning.experiment import Experiment, open_experiment
from drake_disasm.learning.hyperparameters import (
    ALGORITHMS,
    PRESETS,
    override,
    preset,
)
from drake_disasm.learning.jobs import seed_jobs, train_seeds
from drake_disasm.learning.warm_start import check_start
from drake_disasm.scenario import load_scenario
from drake_disasm.studies.transfer import (
    Deployment,
    TransferStudy,
    deploy,
    write_results,
)

_EXAMPLES = """examples:
  python tools/transfer_study.py --before removal --after out/closed/scenario.yaml \\
      --stand-in hidden.yaml --seeds 3 --out out/transfer
  python tools/transfer_study.py ... --out out/transfer --resume   continue after Ctrl-C
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("transfer_study", __doc__, _EXAMPLES)
    _add_scenario_arguments(parser.add_argument)
    _add_agent_arguments(parser.add_argument)
    _add_run_arguments(parser.add_argument)
    cli.add_import_argument(parser)
    cli.add_workers_argument(parser)
    return parser.parse_args(arguments)


def _add_scenario_arguments(add: Callable[..., object]) -> None:
    for name, text in (
        ("before", "the twin as first identified"),
        ("after", "the twin after closing the loop"),
        ("stand-in", "what stands for the robot"),
    ):
        add(f"--{name}", required=True, metavar="NAME|FILE", help=text)
    cli.add_station_argument(add, "cell", "what simulates the stand-in")


def _add_agent_arguments(add: Callable[..., object]) -> None:
    add("--preset", default="best", choices=list(PRESETS), help="(default: best)")
    add("--agent", choices=ALGORITHMS, default="", help="(default: the preset's)")
    add(
        "--hyper",
        nargs="+",
        default=[],
        metavar="KEY=VALUE",
        help="change hyper-parameters, of all trainings",
    )
    add(
        "--episodes",
        type=options.positive,
        default=150,
        metavar="N",
        help="on the twins (default: 150, as in the thesis)",
    )
    add(
        "--stand-in-episodes",
        type=options.positive,
        default=100,
        metavar="N",
        help="in the stand-in (default: 100, as on the thesis's robot)",
    )
    add(
        "--rehearsal",
        type=options.share,
        default=0.5,
        metavar="SHARE",
        help="of each batch in the stand-in that comes from the twin's replay memory "
        "(default: 0.5)",
    )


def _add_run_arguments(add: Callable[..., object]) -> None:
    add("--out", type=Path, required=True, metavar="DIR", help="folder for all results")
    add("--seeds", type=options.positive, default=3, metavar="N", help="(default: 3)")
    add("--first-seed", type=options.seed, default=0, metavar="S", help="(default: 0)")
    add(
        "--validation",
        type=options.positive,
        default=10,
        metavar="N",
        help="greedy episodes before and after training in the stand-in (default: 10)",
    )
    add("--eager", action="store_true", help="don't compile the updates")
    add("--resume", action="store_true", help="continue what is in --out")


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    study = _study(args, arguments)
    seeds = range(args.first_seed, args.first_seed + args.seeds)
    workers = args.workers
    try:
        for name, experiment in study.experiments().items():
            _train(name, experiment, seeds, study.folder / name, args.resume, workers)
    finally:
        print(write_results(study.folder, study.common.provenance))
    print(f"results: {args.out}")
    return 0


def _study(args: argparse.Namespace, arguments: Sequence[str]) -> TransferStudy:
    before = load_scenario(args.before)
    changes = [*args.hyper, f"episodes={args.episodes}"]
    common = Experiment(
        scenario=before,
        station="twin",
        preset=args.preset,
        config=override(preset(args.preset, args.agent), changes),
        compiled=not args.eager,
        validation=args.validation,
        provenance=program.provenance("transfer_study", arguments, args.first_seed),
    )
    return TransferStudy(
        before=before,
        after=load_scenario(args.after),
        stand_in=load_scenario(args.stand_in),
        station=args.station,
        common=common,
        episodes=args.stand_in_episodes,
        rehearsal=args.rehearsal,
        folder=args.out,
    )


def _train(
    name: str,
    experiment: Experiment,
    seeds: range,
    folder: Path,
    resume: bool,
    workers: int,
) -> None:
    """Trains the seeds of one part, after deploying the agents that they start from."""
    if experiment.start:
        check_start(experiment, seeds)
    experiment = open_experiment(experiment, folder, resume)
    jobs = seed_jobs(experiment, seeds, folder)
    with program.ProgressBar(unit="episode", keep=True) as bar:
        if experiment.start:
            deployed = [Deployment(experiment, job.seed, job.folder) for job in jobs]
            _deploy(deployed, workers, _titled(bar, f"{name}, before learning on"))
        train_seeds(jobs, workers, _titled(bar, name))


def _deploy(jobs: Sequence[Deployment], workers: int, progress: Progress) -> None:
    with WorkerPool(workers, process_per_job=True, progress=progress) as pool:
        for _ in pool.run(deploy, jobs):
            pass


def _titled(progress: Progress, title: str) -> Progress:
    """Returns what shows progress under another title."""
    return lambda update: progress(dataclasses.replace(update, stage=title))


if __name__ == "__main__":
    program.run(main)
