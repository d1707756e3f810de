"""Types of command-line options: numbers, checked before anything else happens."""

import argparse
import math

from drake_disasm.common.text import clipped

#: NumPy takes more, but scikit-learn and counting on from a seed do not.
_GREATEST_SEED = 2**31 - 1
_MOST = 10**9


def positive(text: str) -> int:
    """Returns a whole number of at least 1."""
    return _whole(text, 1, _MOST)


def count(text: str) -> int:
    """Returns a whole number of at least 0."""
    return _whole(text, 0, _MOST)


def seed(text: str) -> int:
    """Returns a seed of random numbers: a whole number of at least 0."""
    return _whole(text, 0, _GREATEST_SEED)


def nonnegative(text: str) -> float:
    """Returns a finite number of at least 0."""
    value = _number(text)
    if not (math.isfinite(value) and value >= 0.0):
        raise _refused(text, "a number of at least 0")
    return value


def above_zero(text: str) -> float:
    """Returns a finite number above 0."""
    value = _number(text)
    if not (math.isfinite(value) and value > 0.0):
        raise _refused(text, "a number above zero")
    return value


def above_zero_or_inf(text: str) -> float:
    """Returns a number above 0, or infinity."""
    value = _number(text)
    if not value > 0.0:
        raise _refused(text, "a number above zero, or inf")
    return value


def share(text: str) -> float:
    """Returns a number from 0 to 1."""
    value = _number(text)
    if not 0.0 <= value <= 1.0:
        raise _refused(text, "a number from 0 to 1")
    return value


def _whole(text: str, low: int, high: int) -> int:
    try:
        value = int(text)
    except ValueError:
        raise _refused(text, "a whole number") from None
    if not low <= value <= high:
        raise _refused(text, f"a whole number from {low} to {high}")
    return value


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise _refused(text, "a number") from None


def _refused(text: str, wanted: str) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(f"'{clipped(text)}' is not {wanted}")
