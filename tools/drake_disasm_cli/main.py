"""Finds the subcommand that the command line names, and runs it.

A subcommand's module is imported when it is run, so that `--help` is quick and one that
needs PyTorch does not make the others wait for it.
"""

import importlib
from collections.abc import Callable, Sequence

from drake_disasm.common import program, stopping
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.system_libraries import complaint

#: Subcommands in the order of the help, by what they are for.
COMMANDS = {
    "run the task": {
        "simulate": "run the task, simulated or on the robot, and watch it",
        "evaluate": "compare policies over many episodes",
        "fake-cell": "play the devices of a cell, to try the hardware station",
    },
    "learn": {
        "train": "train a policy on the twin, on the cell or from logs",
        "plot-training": "draw learning curves of several trainings",
        "study": "run a study of learning, and write its report",
    },
    "bring your own robot": {
        "import-log": "make a log of a table, a bag or a dataset",
        "excite": "design a motion that shows an arm's parameters",
        "play-motion": "play a motion on the cell and record it",
    },
    "find what the model lacks": {
        "check-log": "check logs before anything is fitted to them",
        "identify": "find the parameters of a model, with intervals",
        "close-loop": "find which physical effect the model lacks, and add it",
        "diagnose": "find it by the station's own experiments",
        "accept": "say whether to put a policy on the robot",
        "monitor": "watch a robot for changes, episode by episode",
    },
}
SUBCOMMANDS = {
    name: text for group in COMMANDS.values() for name, text in group.items()
}

_USAGE = """usage: drake-disasm COMMAND [ARGUMENTS]

A toolkit for robotic disassembly on Drake.
"""


def run(name: str | None = None) -> None:
    """Runs `drake-disasm`, or one subcommand of it, and exits.

    Args:
        name: of the subcommand; the first word of the command line if None.
    """
    program.run(main if name is None else lambda words: main([name, *words]))


def main(arguments: Sequence[str]) -> int:
    """Runs the subcommand that the first argument names; returns its exit status.

    Raises:
        DisasmError: there is none of that name, or Drake can't be imported.
    """
    if not arguments or arguments[0] in ("-h", "--help"):
        print(overview())
        return 0
    name, *rest = arguments
    if name not in SUBCOMMANDS:
        raise DisasmError(
            f"drake-disasm {name}: no such command; {closest(name, list(SUBCOMMANDS))}"
        )
    return main_of(name)(rest)


def main_of(name: str) -> Callable[[Sequence[str]], int]:
    """Returns the function that runs a subcommand.

    Raises:
        DisasmError: a library of the system that Drake needs is missing.
    """
    try:
        with stopping.deferred():
            module = importlib.import_module(
                f"drake_disasm_cli.{name.replace('-', '_')}"
            )
    except ImportError as error:
        if text := complaint():
            raise DisasmError(text) from error
        raise
    found: Callable[[Sequence[str]], int] = module.main
    return found


def overview() -> str:
    """Returns what `drake-disasm --help` prints."""
    width = max(map(len, SUBCOMMANDS))
    lines = [_USAGE]
    for group, commands in COMMANDS.items():
        lines += [f"{group}:"]
        lines += [f"  {name:{width}}  {text}" for name, text in commands.items()]
        lines += [""]
    return "\n".join([*lines, "drake-disasm COMMAND --help explains one."])


if __name__ == "__main__":
    run()
