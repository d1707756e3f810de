"""What the programs share: an interrupt is not lost."""

import signal
import subprocess
import sys
from pathlib import Path

TOOLS = Path(__file__).parents[2] / "tools"

SWALLOWS = """
import os, signal, time
import cli

def main(arguments):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1)
    except KeyboardInterrupt:
        pass  # as a library's callback does
    cli.stop_if_interrupted()
    return 0

cli.run(main)
"""


def test_a_swallowed_interrupt_stops_the_run_all_the_same() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SWALLOWS], cwd=TOOLS, capture_output=True, text=True
    )
    assert done.returncode == 130
    assert "interrupted" in done.stderr


def test_a_program_in_the_background_ignores_interrupts_still() -> None:
    """A shell starts `simulate.py &` with SIGINT ignored; so it must stay."""
    done = subprocess.run(
        [sys.executable, "-c", SWALLOWS],
        cwd=TOOLS,
        capture_output=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )
    assert done.returncode == 0
