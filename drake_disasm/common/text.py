"""Foreign text and values in messages: short, printable, on one line."""

import reprlib

_LONGEST = 80  # characters of a value
_short = reprlib.Repr()
_short.maxlevel = 2
_short.maxstring = _short.maxother = _short.maxlong = _LONGEST


def shown(value: object) -> str:
    """Returns a value as Python writes it, shortened whatever it holds."""
    return clipped(_short.repr(value), _LONGEST)


def clipped(text: str, most: int = _LONGEST) -> str:
    """Returns text without line ends and control characters, of `most` characters."""
    start = " ".join(text[: 4 * most].split())
    plain = "".join(
        c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in start
    )
    return plain if len(plain) <= most else f"{plain[: most - 3]}..."
