"""One program per device of a robot, on this machine: locks that die with it.

A second program that commands the arm drives it against the first. One that only looks
would take the stream of the force/torque sensor, which has one client, from the program
that moves the arm.
"""

import getpass
import hashlib
import json
import os
import socket
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, Self

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.file_lock import try_lock

#: The same for all users, which a temporary folder of one's own would not be.
_FOLDER = Path("/tmp")
_EVERYBODY = 0o666
_LONGEST = 4096  # of what a lock's file says [bytes]


class DeviceLocks:
    """Takes devices for this process; the system lets go of them when it dies.

    Args:
        devices: address, the same however it is written, to what somebody else does
            who has it: "commands this robot".
        folder: of the locks' files, which stay.
    """

    def __init__(self, devices: Mapping[str, str], folder: Path = _FOLDER) -> None:
        self._devices, self._folder = dict(devices), folder
        self._files: list[IO[bytes]] = []

    def acquire(self) -> None:
        """Takes all devices; again it does nothing.

        Raises:
            DisasmError: another program has one of them; says which program.
        """
        if self._files:
            return
        try:
            for address, does in self._devices.items():
                self._files.append(self._taken(address, does))
        except BaseException:
            self.release()
            raise

    def release(self) -> None:
        """Lets go of all devices."""
        while self._files:
            self._files.pop().close()

    def __enter__(self) -> Self:
        """Takes them."""
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        """Lets go of them."""
        self.release()

    def _taken(self, address: str, does: str) -> IO[bytes]:
        """Returns the locked file of a device, which says who has it."""
        path = self._folder / f"drake_disasm_{_digest(address)}.lock"
        file = _opened(path)
        if not try_lock(file):
            holder = _holder(file)
            file.close()
            raise DisasmError(f"{holder[0]} {does} ({address}): {holder[1]}")
        file.truncate(0)
        file.write(json.dumps(_self_description() | {"device": address}).encode())
        file.flush()
        return file


def lcm_address(url: str, channel: str) -> str:
    """Returns the address of a channel of LCM; "" where no other process hears it.

    Args:
        url: as `DrakeLcm.get_lcm_url` has it; how far messages go plays no part.
        channel: of LCM.
    """
    scheme, _, rest = url.lower().partition("://")
    if scheme == "memq":
        return ""
    return f"{scheme}://{rest.partition('?')[0]} {channel}"


def _digest(address: str) -> str:
    return hashlib.sha256(address.encode()).hexdigest()[:16]


def _opened(path: Path) -> IO[bytes]:
    """Opens a file that every user can lock; makes it if need be.

    It is not created where it may be already: Linux refuses that for another user's
    file in a folder such as /tmp.
    """
    flags = os.O_RDWR | os.O_NOFOLLOW
    try:
        try:
            return os.fdopen(os.open(path, flags), "r+b")
        except FileNotFoundError:
            pass
        try:
            made = os.open(path, flags | os.O_CREAT | os.O_EXCL, _EVERYBODY)
        except FileExistsError:  # made by somebody else, between the two
            return os.fdopen(os.open(path, flags), "r+b")
        os.fchmod(made, _EVERYBODY)  # whatever the umask is
        return os.fdopen(made, "r+b")
    except OSError as error:
        raise DisasmError(
            f"{path}: cannot be locked ({error.strerror}), so another program might "
            "use the robot; see whose it is, then remove it"
        ) from error


def _self_description() -> dict[str, Any]:
    return {
        "pid": os.getpid(),
        "program": Path(sys.argv[0]).name or "python",
        "user": _user(),
        "host": socket.gethostname(),
        "since": time.strftime("%H:%M:%S"),
    }


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a user that the system has no name for
        return str(os.getuid())


def _holder(file: IO[bytes]) -> tuple[str, str]:
    """Returns who has a lock, and what can be done about it."""
    try:
        found = json.loads(file.read(_LONGEST))
        pid = int(found["pid"])
        keys = ("program", "user", "host", "since")
        program, user, host, since = (str(found[k])[:80] for k in keys)
    except (ValueError, KeyError, TypeError, RecursionError):  # half written
        return "another program", "wait for it, or stop it"
    if pid == os.getpid() and host == socket.gethostname():
        return "this program", "by another station; close that one first"
    where = f" on {host}" if host != socket.gethostname() else ""
    who = f"{program} (pid {pid}{where}, {user}, since {since})"
    return "another program", f"{who}; wait for it, or stop it"
