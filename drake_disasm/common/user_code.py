"""Imports Python files and modules that a user names."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

from drake_disasm.common.errors import DisasmError


def import_named(name: str, content: str) -> ModuleType:
    """Imports a module, or a Python file, whose folder joins the search path.

    A file is imported by its stem, the name by which pickle finds it in a worker.

    Args:
        name: of a module, or a path that ends in .py.
        content: what the file should hold, for messages: "effects".

    Raises:
        DisasmError: there is no such file or module, it fails, or another module has
            the file's name.
    """
    if not name.endswith(".py"):
        return import_module(name)
    path = Path(name).resolve()
    if not path.is_file():
        raise DisasmError(f"{path}: no such file; name a Python file with {content}")
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    module = import_module(path.stem)
    if Path(module.__file__ or "").resolve() != path:
        raise DisasmError(
            f"{path}: another module has the name {path.stem} ({module.__file__}); "
            "rename the file"
        )
    return module


def import_module(name: str, source: str = "") -> ModuleType:
    """Imports a module.

    Args:
        name: of the module.
        source: who names it, for messages; the name itself if empty.

    Raises:
        DisasmError: it fails, whatever is wrong with it.
    """
    source = source or name
    try:
        return importlib.import_module(name)
    except DisasmError as error:
        raise DisasmError(f"{source}: {error}") from None
    except Exception as error:  # whatever a user's module does wrong
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise DisasmError(
            f"{source}: can't be imported ({reason}); name a Python file or an "
            "installed module that works"
        ) from None
