"""Gymnasium knows the ids once drake_disasm is imported, and loads no Drake for it."""

import subprocess
import sys

import gymnasium
import pytest

_ORDERS = {
    "gymnasium first": "import gymnasium, drake_disasm",
    "gymnasium last": "import drake_disasm, gymnasium",
    "looked for, imported later": "import importlib.util, drake_disasm; "
    "importlib.util.find_spec('gymnasium'); import gymnasium",
}
_CHECK = """
import sys
assert not {"pydrake", "torch"} & sys.modules.keys()
assert gymnasium.spec("drake_disasm/Removal-v0").kwargs == {"scenario": "removal"}
"""


@pytest.mark.parametrize("imports", _ORDERS.values(), ids=_ORDERS)
def test_ids_are_there_without_drake(imports: str) -> None:
    command = [sys.executable, "-W", "error", "-c", imports + _CHECK]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_id_may_name_the_module() -> None:
    env = gymnasium.make("drake_disasm:drake_disasm/RemovalTurned-v0")
    assert env.unwrapped.simulation.scenario.name == "removal_turned"


def test_drake_disasm_alone_loads_neither_gymnasium_nor_numpy() -> None:
    check = (
        "import sys, drake_disasm; assert not {'gymnasium','numpy'} & {*sys.modules}"
    )
    assert subprocess.run([sys.executable, "-c", check]).returncode == 0
