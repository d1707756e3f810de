"""One program per device: who is told, who has it, and when it is free again."""

import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from drake_disasm.safety.robot_lock import DeviceLocks, lcm_address
from tests.refusals import refused

ARM = "udpm://239.255.76.67:7667 IIWA_COMMAND"
HOLD = f"""
import sys
from pathlib import Path
from drake_disasm.safety.robot_lock import DeviceLocks

sys.argv[0] = "tools/simulate.py"
with DeviceLocks({{"{ARM}": "commands this robot"}}, Path(sys.argv[1])):
    print("locked", flush=True)
    sys.stdin.read()
"""


def _locks(folder: Path, *addresses: str) -> DeviceLocks:
    return DeviceLocks(dict.fromkeys(addresses, "commands this robot"), folder)


def test_a_second_program_is_told_who_has_the_robot_until_that_dies(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, tmp_path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert process.stdout and process.stdout.readline() == b"locked\n"
    second = _locks(tmp_path, "another arm", ARM)
    with refused(f"another program commands this robot ({ARM}): ", process.pid):
        second.acquire()
    with _locks(tmp_path, "another arm"):  # was let go of again
        pass
    process.send_signal(signal.SIGKILL)
    process.communicate()
    with second:
        pass


def test_a_second_station_of_a_program_is_told_so(tmp_path: Path) -> None:
    with _locks(tmp_path, ARM) as first:
        first.acquire()  # as `connect` does for each episode
        with refused("this program ", "another station"):
            _locks(tmp_path, ARM).acquire()
        with _locks(tmp_path, "another arm"):
            pass
    with _locks(tmp_path, ARM):
        pass


@pytest.mark.parametrize("content", [b"", b"[1]", b'{"pid": "x"}', b"[" * 9999])
def test_what_a_lock_says_need_not_be_readable(tmp_path: Path, content: bytes) -> None:
    with _locks(tmp_path, ARM):
        (file,) = tmp_path.iterdir()
        file.write_bytes(content)
        with refused("another program commands this robot"):
            _locks(tmp_path, ARM).acquire()


def test_every_user_can_lock_and_no_link_is_followed(tmp_path: Path) -> None:
    with _locks(tmp_path, ARM):
        (file,) = tmp_path.iterdir()
        assert stat.S_IMODE(file.stat().st_mode) == 0o666
    file.unlink()
    file.symlink_to(tmp_path / "elsewhere")
    with refused(".lock: cannot be locked", "; see whose"):
        _locks(tmp_path, ARM).acquire()


def test_the_way_an_address_is_written_plays_no_part() -> None:
    one = lcm_address("udpm://239.255.76.67:7667?ttl=0", "IIWA_COMMAND")
    assert one == lcm_address("UDPM://239.255.76.67:7667", "IIWA_COMMAND") == ARM
    assert one != lcm_address("udpm://239.255.76.67:7668", "IIWA_COMMAND")
    assert lcm_address("memq://", "IIWA_COMMAND") == ""
