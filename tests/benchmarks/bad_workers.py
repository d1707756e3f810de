"""Workers of the fuzzer that hang or die; in a file of their own, to start quickly."""

import os
import time
from multiprocessing.connection import Connection
from typing import Any


def hanging(job: Any, folder: str, sender: Connection) -> None:
    """Reads the first case, and stays with the second; later ones go well."""
    sender.send("ready")
    for number in job.numbers:
        if number == 1:
            time.sleep(1e6)
        sender.send(("refused", 0.0))


def dying(job: Any, folder: str, sender: Connection) -> None:
    """Dies of the second case as of a fault in a library."""
    sender.send("ready")
    for number in job.numbers:
        if number == 1:
            os._exit(9)
        sender.send(("accepted", 0.0))
