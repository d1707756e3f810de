"""Missing system libraries are one line with the command that installs them."""

import subprocess
import sys

import pytest

from drake_disasm.common import system_libraries


def test_nothing_is_missing_where_drake_runs() -> None:
    path = system_libraries.__file__
    ran = subprocess.run([sys.executable, "-I", path], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (0, "")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Debian's names")
def test_what_is_missing_is_named_with_its_package() -> None:
    line = system_libraries.complaint({"libno_such.so.7": "libno-such7"})
    assert "libno_such.so.7" in line and "\n" not in line
    assert line.endswith("apt-get install libno-such7")
