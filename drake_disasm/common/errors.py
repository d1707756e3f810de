"""The one exception that users are meant to see."""


class DisasmError(Exception):
    """Bad input, said in one line: what is wrong, where, and the remedy.

    The programs in `tools/` print the message alone and exit with status 2;
    code that builds on the package can catch it like any other exception.
    """
