"""A serial line to a server on the loopback, as a USB adapter would be."""

import contextlib
import os
import select
import socket
import threading
import tty
from collections.abc import Callable, Iterator

from drake_disasm.fakes.robotiq_gripper import TICK


@contextlib.contextmanager
def serial_line(port: int) -> Iterator[tuple[str, Callable[[], None]]]:
    """Yields a device's path, and what unplugs it.

    Args:
        port: of 127.0.0.1, to which bytes go and from which they come.
    """
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    path, stopping = os.ttyname(theirs), threading.Event()
    with socket.create_connection(("127.0.0.1", port)) as far:
        ends: list[int | socket.socket] = [ours, far]

        def carry() -> None:
            """Copies bytes both ways."""
            while not stopping.is_set():
                ready, _, _ = select.select(ends, [], [], TICK)
                if ours in ready:
                    far.sendall(os.read(ours, 256))
                if far in ready:
                    os.write(ours, far.recv(256))

        thread = threading.Thread(target=carry, name="serial line", daemon=True)
        thread.start()

        def unplug() -> None:
            """Ends the line; its device is gone."""
            if stopping.is_set():
                return
            stopping.set()
            thread.join()
            os.close(theirs)
            os.close(ours)

        try:
            yield path, unplug
        finally:
            unplug()
