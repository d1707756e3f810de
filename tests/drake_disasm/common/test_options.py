"""Types of options: what they take, and what they refuse."""

import argparse
import math

import pytest

from drake_disasm.common import options

NINES = "9" * 5000
ACCEPTED = [
    (options.positive, "1", 1),
    (options.count, "0", 0),
    (options.seed, "2147483647", 2**31 - 1),
    (options.nonnegative, "0", 0.0),
    (options.above_zero, "1e-9", 1e-9),
    (options.above_zero_or_inf, "inf", math.inf),
    (options.share, "1", 1.0),
]
REFUSED = [
    (options.positive, ("0", "-1", "1.5", "", "nan", NINES)),
    (options.count, ("-1", "x", NINES)),
    (options.seed, ("-1", "2147483648", "0x1", NINES)),
    (options.nonnegative, ("-1", "-1e-9", "nan", "inf", "-inf", "one", NINES)),
    (options.above_zero, ("0", "-1", "nan", "inf", NINES)),
    (options.above_zero_or_inf, ("0", "-inf", "nan")),
    (options.share, ("-0.1", "1.1", "nan", "inf")),
]


def test_accepted() -> None:
    for kind, text, value in ACCEPTED:
        assert kind(text) == value


@pytest.mark.parametrize(("kind", "texts"), REFUSED)
def test_refused_in_one_short_line(kind, texts: tuple[str, ...]) -> None:
    for text in texts:
        with pytest.raises(argparse.ArgumentTypeError) as caught:
            kind(text)
        message = str(caught.value)
        assert f"'{text[:40]}" in message
        assert len(message) < 150 and "\n" not in message
