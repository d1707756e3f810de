"""Trains a policy by reinforcement learning, on the twin or the cell or from logs.

Each seed is a training of its own, in a process of its own. All results go into one
folder: per seed the log of all episodes, a checkpoint after each of them, the policy
and its validation; over the seeds a learning curve and a summary. A run that was
interrupted or killed continues with --resume, bit for bit.
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from drake_disasm.common import options, program
from drake_disasm.common.cluster import executor_for
from drake_disasm.learning.experiment import (
    MOST_RECORDED,
    Experiment,
    open_experiment,
    write_summary,
)
from drake_disasm.learning.hyperparameters import (
    ALGORITHMS,
    PRESETS,
    override,
    preset,
)
from drake_disasm.learning.jobs import seed_jobs, train_seeds
from drake_disasm.learning.vector_environment import DEVICES, choose_device
from drake_disasm.learning.warm_start import check_start
from drake_disasm.scenario import load_scenario
from drake_disasm_cli import common

_EXAMPLES = """examples:
  drake-disasm train --out out/first --episodes 30          a first look
  drake-disasm train --out out/first --episodes 30 --resume      after Ctrl-C
  drake-disasm train --agent ddpg --preset chapter3 --scenario chapter3 \\
      --psi 0.0003 --seeds 10 --out out/chapter3                the thesis's chapter 3
  drake-disasm train --agent ddpg --preset chapter3 --scenario chapter3 \\
      --seeds 64 --lockstep --out out/many                 all on batches of twins
  drake-disasm train --scenario removal_randomised --out out/randomised
  drake-disasm train --scenario removal_randomised --envs 16384 --device cuda \\
      --episodes 200000 --hyper updates_per_step=0.001 replay=1000000 batch=4096 \\
      --out out/gpu
  drake-disasm train --agent sac --preset chapter4 --out out/sac \\
      --hyper layer_norm=true 'hidden=[64, 64]'
  drake-disasm train --scenario removal --also iiwa_peg iiwa_bayonet \\
      --hyper axes=stage --out out/any_part           one policy for all three parts
  drake-disasm train --log out/chapter3/seed_000/log --scenario chapter3 \\
      --preset chapter3 --out out/offline                      without acting
  drake-disasm train --station cell --start-from out/first \\
      --scenario removal_turned --hyper demonstrations=0.5 --out out/in_the_cell
"""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm train", __doc__, _EXAMPLES)
    common.add_scenario_arguments(parser)
    parser.add_argument(
        "--also",
        nargs="+",
        default=[],
        metavar="NAME|FILE",
        help="further scenarios that the same policy learns on, as many episodes each; "
        "with other parts --hyper axes=stage is needed",
    )
    _add_task_arguments(parser.add_argument)
    _add_batch_argument(parser.add_argument)
    _add_agent_arguments(parser.add_argument)
    _add_data_arguments(parser.add_argument)
    _add_run_arguments(parser.add_argument)
    common.add_executor_arguments(parser, "; seeds at a time")
    return parser.parse_args(arguments)


def _add_task_arguments(add: Callable[..., object]) -> None:
    common.add_station_argument(
        add, "twin", "what it learns on: the twin is six times faster"
    )
    add(
        "--psi",
        type=options.nonnegative,
        metavar="M",
        help="imprecision of the robot [m], e.g. 0.0003 (default: the scenario's)",
    )


def _add_batch_argument(add: Callable[..., object]) -> None:
    add(
        "--envs",
        type=options.positive,
        default=1,
        metavar="N",
        help="episodes at a time (of each scenario), on a batch of twins with IMPACT "
        "contact; validation "
        "stays on the diagram of the scenario (default: 1, on the diagram). From "
        f"{MOST_RECORDED} on no log is written, only episodes.csv; updates_per_step "
        "then wants to be less than 1",
    )
    add(
        "--device",
        choices=DEVICES,
        default="auto",
        help="cpu or cuda keep tensors there from the step to the update, for --envs "
        "and --log; numpy draws random numbers row by row; auto is cuda from 1024 "
        "--envs on, if it is there, and else numpy (default: auto)",
    )
    add(
        "--lockstep",
        action="store_true",
        help="train all seeds side by side, on a batch of twins with IMPACT contact, "
        "as many batches as workers; pays for some thirty seeds and more",
    )


def _add_agent_arguments(add: Callable[..., object]) -> None:
    add(
        "--preset",
        default="best",
        choices=list(PRESETS),
        help="hyper-parameters: the thesis's chapters, or our best (default: best)",
    )
    add(
        "--agent",
        choices=ALGORITHMS,
        default="",
        help="algorithm (default: ddpg; of the preset best: sac)",
    )
    add(
        "--episodes",
        type=options.positive,
        metavar="N",
        help="per seed (default: the preset's)",
    )
    add(
        "--hyper",
        nargs="+",
        default=[],
        metavar="KEY=VALUE",
        help="change hyper-parameters; drake_disasm/learning/hyperparameters.py "
        "lists them with their units",
    )


def _add_data_arguments(add: Callable[..., object]) -> None:
    add(
        "--log",
        nargs="+",
        type=Path,
        default=[],
        metavar="DIR",
        help="learn from these logs alone, offline",
    )
    add(
        "--updates",
        type=options.positive,
        metavar="N",
        help="with --log: gradient updates (default: one per transition)",
    )
    add(
        "--demonstrations",
        nargs="+",
        type=Path,
        default=[],
        metavar="DIR",
        help="logs to mix into each batch; their share is the hyper-parameter "
        "demonstrations",
    )
    add(
        "--start-from",
        type=Path,
        metavar="DIR",
        help="start from the agents of the same seeds in this training; with --hyper "
        "demonstrations=0.5 half of each batch comes from their replay memory",
    )


def _add_run_arguments(add: Callable[..., object]) -> None:
    add("--out", type=Path, required=True, metavar="DIR", help="folder for all results")
    add(
        "--seeds",
        type=options.positive,
        default=1,
        metavar="N",
        help="how many trainings (default: 1)",
    )
    add("--first-seed", type=options.seed, default=0, metavar="S", help="(default: 0)")
    add(
        "--validation",
        type=options.positive,
        default=10,
        metavar="N",
        help="greedy episodes after each training, of each scenario (default: 10)",
    )
    add(
        "--threads",
        type=options.positive,
        default=1,
        metavar="N",
        help="of the updates of each seed; 2 pays for one seed with large batches "
        "(default: 1)",
    )
    add("--eager", action="store_true", help="don't compile the updates")
    add("--resume", action="store_true", help="continue what is in --out")


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    experiment = _experiment(args, arguments)
    seeds = range(args.first_seed, args.first_seed + args.seeds)
    if experiment.start:
        check_start(experiment, seeds)
    unit = "round" if experiment.logs else "episode"
    with executor_for(args.executor, args.scheduler, args.tls) as (executor, host):
        experiment = open_experiment(experiment, args.out, args.resume)
        jobs = seed_jobs(experiment, seeds, args.out)
        try:
            with program.ProgressBar(unit, keep=True) as bar:
                train_seeds(jobs, args.workers, bar, executor, host)
        finally:
            print(write_summary(args.out))
    print(f"results: {args.out}")
    return 0


def _experiment(args: argparse.Namespace, arguments: Sequence[str]) -> Experiment:
    overrides = list(args.overrides)
    if args.psi is not None:
        overrides.append(f"imprecision={args.psi}")
    changes = list(args.hyper)
    if args.episodes is not None:
        changes.append(f"episodes={args.episodes}")
    return Experiment(
        scenario=load_scenario(args.scenario, overrides),
        others=tuple(load_scenario(name, overrides) for name in args.also),
        station=args.station,
        preset=args.preset,
        config=override(preset(args.preset, args.agent), changes),
        compiled=not args.eager,
        threads=args.threads,
        validation=args.validation,
        logs=_hashes(args.log),
        updates=args.updates or 0,
        demonstrations=_hashes(args.demonstrations),
        start=str(args.start_from or ""),
        envs=args.envs,
        device=choose_device(args.device, args.envs),
        lockstep=args.lockstep,
        provenance=program.provenance("drake-disasm train", arguments, args.first_seed),
    )


def _hashes(folders: Sequence[Path]) -> dict[str, str]:
    """Returns the hash of each log's data; refuses a log that can't be read."""
    if not folders:
        return {}
    return {str(log.folder): log.data_hash for log in common.named_logs(folders)}
