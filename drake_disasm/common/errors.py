"""The exceptions that users are meant to see, and the one kind of warning."""


class DisasmError(Exception):
    """Bad input, said in one line: what is wrong, where, and the remedy.

    The programs in `tools/` print the message alone and exit with status 2;
    code that builds on the package can catch it like any other exception.
    """


class UnreachableError(DisasmError):
    """The arm can't go where it is told, within its limits."""


class DivergedError(DisasmError):
    """A simulation has no next state, or one of no numbers."""


class DisasmWarning(UserWarning):
    """Something that works and may surprise, said in one line, with the remedy."""
