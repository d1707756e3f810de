"""Watches a robot: judges each new episode by a closed loop of the robot in good order.

Prints a line of JSON for each episode, and keeps them in episodes.jsonl. If something
has changed it says what is suspected and since when, and ends with status 3. Without a
change an alarm comes once in --false-alarm-every episodes on average, or less often.
The report shows the course. The same command goes on where it was stopped.

The reference is the output folder of `drake-disasm close-loop`, of any kind of log.
With three episodes or more it is known how much these scatter; else the first three
new episodes are taken to be in order, too. Episodes are taken to be independent: a
robot that is warming up raises alarms.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from drake_disasm.common import options, program, stopping
from drake_disasm.common.errors import DisasmError
from sysid.monitoring.judgement import Judgement
from sysid.monitoring.record import PAGE, Record
from sysid.monitoring.reference import Reference
from sysid.monitoring.watched import Arrival, WatchedFolder

EXIT_ALARM = 3
#: In the environment of --on-alarm.
ALARM_VARIABLE = "DRAKE_DISASM_ALARM"
_EXAMPLES = """examples:
  drake-disasm monitor --reference out/closed --log out/days --out out/watch
  drake-disasm monitor --reference out/closed --log out/days --follow \\
      --on-alarm 'mail -s "robot has changed" me@example.org'
"""
_POLLED = 1.0  # s between two looks at the folder


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns the parsed command line."""
    parser = program.argument_parser("drake-disasm monitor", __doc__, _EXAMPLES)
    add = parser.add_argument
    add(
        "--reference",
        required=True,
        type=Path,
        metavar="DIR",
        help="output folder of `drake-disasm close-loop`, of the robot in good order",
    )
    add(
        "--log",
        required=True,
        type=Path,
        metavar="DIR",
        help="a folder to which logs are added, taken in the order of their names; or "
        "one log that grows",
    )
    add(
        "--follow",
        action="store_true",
        help="go on waiting for episodes, until an alarm or Ctrl-C (default: judge "
        "those that are there)",
    )
    add(
        "--false-alarm-every",
        type=_more_than_one,
        default=1000.0,
        metavar="N",
        help="mean number of episodes between alarms if nothing changes (default: "
        "1000)",
    )
    add(
        "--keep-going",
        action="store_true",
        help="go on after an alarm, with the reference alone",
    )
    add(
        "--on-alarm",
        metavar="COMMAND",
        help="shell command that an alarm starts, without waiting for it; it gets the "
        f"alarm's line on stdin and in ${ALARM_VARIABLE}",
    )
    add(
        "--out",
        type=Path,
        metavar="DIR",
        help="a folder (default: `monitor` in that of the reference)",
    )
    return parser.parse_args(arguments)


def _more_than_one(text: str) -> float:
    """Returns a number of episodes above one."""
    value = options.above_zero(text)
    if value <= 1.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above one")
    return value


def main(arguments: Sequence[str]) -> int:
    """Runs the program; returns its exit status."""
    args = parse(arguments)
    if not args.log.is_dir():
        raise DisasmError(f"{args.log}: is no folder; name one to which logs are added")
    reference = Reference.read(args.reference)
    out = args.out or args.reference / "monitor"
    if not out.is_dir():
        _refuse_other_robot(reference, WatchedFolder(args.log.resolve()))
        _say("reading the reference's logs")
    origin = program.provenance("drake-disasm monitor", arguments, 0)
    record = Record.open(
        out.absolute(),
        reference,
        args.log.resolve(),
        args.false_alarm_every,
        origin,
        args.follow,
    )
    _say_what_it_is(record)
    if record.monitor.has_alarm:
        if not args.keep_going:
            _say(
                f"alarm: {record.monitor.recent[-1]['sentence']}; --keep-going goes on"
            )
            return EXIT_ALARM
        record.monitor.restart()
    try:
        return _watch(record, args)
    finally:
        record.draw()
        _say(f"report: {out / PAGE}")


def _refuse_other_robot(reference: Reference, watched: WatchedFolder) -> None:
    """Refuses a folder whose first episode is of another robot, before all else.

    Raises:
        DisasmError: it is, or the folder is gone.
    """
    first = next((each.log for each in watched.arrivals() if each.log), None)
    if first is not None:
        reference.refuse_other(first)


def _watch(record: Record, args: argparse.Namespace) -> int:
    """Judges episodes as they come; returns the exit status."""
    hooks: list[subprocess.Popen[bytes]] = []
    is_first, alarms = True, 0
    while True:
        for arrival in record.watched.arrivals():
            stopping.stop_if_interrupted()
            judgement = _judged(record, arrival)
            line = record.keep(judgement)
            print(line, flush=True)
            if judgement.role == "skipped":
                _say(f"skipped: {arrival.folder.name}: {judgement.reason}")
            if judgement.is_alarm:
                alarms += 1
                _say(f"alarm: {judgement.sentence}\n  {judgement.command}")
                hooks += _started(args.on_alarm, line)
                if not args.keep_going:
                    return EXIT_ALARM
                record.monitor.restart()
        hooks = [hook for hook in hooks if hook.poll() is None]
        if not args.follow:
            _refuse_nothing(record)
            return EXIT_ALARM if alarms else 0
        if is_first:
            record.draw()
            _say(f"waiting for episodes in {args.log}; Ctrl-C ends")
        is_first = False
        stopping.stop_if_interrupted()
        time.sleep(_POLLED)


def _judged(record: Record, arrival: Arrival) -> Judgement:
    """Returns what is said of an episode that has come; it does not come again."""
    record.watched.take(arrival)
    monitor = record.monitor
    if arrival.log is None:
        return monitor.skip(arrival.folder, arrival.number, arrival.error)
    try:
        return monitor.judge(arrival.log)
    except DisasmError as error:
        return monitor.skip(arrival.folder, arrival.number, str(error))


def _refuse_nothing(record: Record) -> None:
    """Refuses a folder in which there was no episode of the robot.

    Raises:
        DisasmError: there was none.
    """
    roles = {each["role"] for each in record.monitor.recent}
    if not roles:
        raise DisasmError(
            f"{record.watched.folder}: has no log yet; record one, or wait for it with "
            "--follow"
        )
    if roles == {"skipped"} and not record.monitor.starts:
        raise DisasmError(
            f"{record.watched.folder}: no episode could be judged "
            f"({record.monitor.recent[-1]['reason']})"
        )


def _say_what_it_is(record: Record) -> None:
    """Says on stderr what serves as reference, and whether that is provisional."""
    monitor = record.monitor
    if monitor.reference.is_provisional:
        _say("the reference's verdict is provisional: what it lacks may raise alarms")
    if monitor.count:
        _say(f"goes on after {monitor.count} episodes")
    if monitor.missing and not monitor.starts:
        _say(
            f"the reference has {len(monitor.baseline)} episodes of which the scatter "
            f"is known: the first new ones serve as reference; changes are found late "
            "at first"
        )


def _started(command: str | None, line: str) -> list[subprocess.Popen[bytes]]:
    """Returns the process of --on-alarm, which is not waited for."""
    if command is None:
        return []
    with tempfile.TemporaryFile() as stream:
        stream.write(f"{line}\n".encode())
        stream.seek(0)
        return [
            subprocess.Popen(
                command,
                shell=True,
                stdin=stream,
                stdout=sys.stderr.fileno() if _has_descriptor() else None,
                env=os.environ | {ALARM_VARIABLE: line},
                start_new_session=True,
            )
        ]


def _has_descriptor() -> bool:
    """Returns whether stderr is a file of the system, and no buffer of a notebook."""
    try:
        sys.stderr.fileno()
    except (OSError, ValueError):
        return False
    return True


def _say(text: str) -> None:
    """Prints a line on stderr: stdout has lines of JSON alone."""
    if text:
        print(program.with_options(text), file=sys.stderr, flush=True)
