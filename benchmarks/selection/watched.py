"""Which settings a program reads."""

import dataclasses
import sys
from typing import Any

#: Functions of dataclasses that read all fields whatever comes of it.
_COPYING = ("__eq__", "__hash__", "__repr__", "replace", "_replace", "_asdict_inner")


def watched(settings: Any, read: set[str]) -> Any:
    """Returns the same settings, of a class that notes which fields are read.

    Args:
        settings: a dataclass.
        read: gets the names of the fields.
    """
    kind = type(settings)
    names = {field.name for field in dataclasses.fields(kind)}

    def noted(self: Any, name: str) -> Any:
        """Returns an attribute."""
        if name in names and sys._getframe(1).f_code.co_name not in _COPYING:
            read.add(name)
        return object.__getattribute__(self, name)

    values = {name: getattr(settings, name) for name in names}
    return type(kind.__name__, (kind,), {"__getattribute__": noted})(**values)
