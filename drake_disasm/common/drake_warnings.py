"""Drake's warnings about model files: counted, and shown to who asks for them.

Drake warns of each element of a URDF that it does not use, once per reading; an arm's
description has dozens, and a program reads it several times.
"""

import logging

#: Drake's messages go to this logger of Python's.
_LOGGER = "drake"


class _Filter(logging.Filter):
    """Keeps warnings and remarks back; remembers the warnings that differ."""

    def __init__(self) -> None:
        super().__init__()
        self.is_verbose = False
        self.messages: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Returns whether a message is shown."""
        if self.is_verbose or record.levelno > logging.WARNING:
            return True
        if record.levelno == logging.WARNING:
            self.messages.add(record.getMessage())
        return False


_filter = _Filter()


def keep_back() -> None:
    """Holds Drake's warnings back from here on."""
    logging.getLogger(_LOGGER).addFilter(_filter)


def are_kept_back() -> bool:
    """Returns whether warnings are held back."""
    kept_back = _filter in logging.getLogger(_LOGGER).filters
    return kept_back and not _filter.is_verbose


def show() -> None:
    """Shows them from here on."""
    _filter.is_verbose = True


def summary() -> str:
    """Returns a line that says how many were kept back; nothing if none were."""
    count = len(_filter.messages)
    words = "warning" if count == 1 else "warnings"
    return f"Drake: {count} {words} about models; --verbose shows them" if count else ""
