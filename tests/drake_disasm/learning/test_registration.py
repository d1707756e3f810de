"""Gymnasium knows the ids once drake_disasm is imported, and loads no Drake for it."""

import subprocess
import sys

import gymnasium

_CHECK = """
import sys, gymnasium, drake_disasm
assert not {"pydrake", "torch"} & sys.modules.keys()
assert gymnasium.spec("drake_disasm/Removal-v0").kwargs == {"scenario": "removal"}
"""


def test_ids_are_there_without_drake() -> None:
    command = [sys.executable, "-W", "error", "-c", _CHECK]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    env = gymnasium.make("drake_disasm:drake_disasm/RemovalTurned-v0")
    assert env.unwrapped.simulation.scenario.name == "removal_turned"
