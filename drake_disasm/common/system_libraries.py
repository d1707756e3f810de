"""Whether the system libraries are there that Drake's wheel needs and does not bring.

Without them `import pydrake` fails with a name that no package has. This file imports
Python's own library only, and runs by itself before Drake is installed.
"""

import ctypes
import sys
from collections.abc import Mapping

#: Debian's and Ubuntu's packages, by the library that each provides.
PACKAGES = {
    "libglib-2.0.so.0": "libglib2.0-0",
    "libX11.so.6": "libx11-6",
    "libSM.so.6": "libsm6",
}


def complaint(packages: Mapping[str, str] = PACKAGES) -> str:
    """Returns a line that names what is missing and how to get it; empty if nothing.

    Args:
        packages: by library.
    """
    missing = [name for name in packages if not _loads(name)]
    if not missing or not sys.platform.startswith("linux"):
        return ""
    names = " ".join(packages[name] for name in missing)
    return (
        f"Drake needs {', '.join(missing)}, which this system lacks; "
        f"on Debian or Ubuntu: sudo apt-get install {names}"
    )


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


if __name__ == "__main__":
    text = complaint()
    sys.exit(f"error: {text}" if text else 0)
