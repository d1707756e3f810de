"""YAML that is too large to be meant is refused; the rest is read as ever."""

import pytest
import yaml

from drake_disasm.common.bounded_yaml import load
from tests.refusals import refusal

#: Nine lists of nine aliases each of the one before: 3e8 values in 300 bytes.
BOMB = "a0: &a0 [x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10)
)
#: Each list holds the one before, at another depth.
TOWER = "a0: &a0 [x]\n" + "".join(
    f"a{i}: &a{i} [[[[*a{i - 1}]]]]\n" for i in range(1, 30)
)
REFUSED = {
    "deep flow": ("[" * 41 + "]" * 41, "line 1: nested deeper than 40"),
    "deep block": ("\n".join("  " * i + "a:" for i in range(500)), "nested deeper"),
    "alias bomb": (BOMB, "aliases written out"),
    "tower of aliases": (TOWER, "nested deeper"),
    "within itself": ("a: &a [*a]", "within itself"),
    "long list": (f"[{'1, ' * 20_000}]", "more than 10000 values"),
    "long text": ("a: " + "x" * 10_001, "more than 10000 characters"),
    "long number": ("a: " + "9" * 5000, "not YAML"),
    "date": ("a: 2020-13-45", "not YAML (month must be in 1..12)"),
    "Python": ("!!python/object/apply:os.getcwd []", "not YAML"),
    "unknown alias": ("a: *b", "not YAML"),
    "cut": ("a: [1", "line 1: not YAML"),
    "two documents": ("a: 1\n---\nb: 1", "not YAML"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_in_one_short_line(name: str) -> None:
    text, words = REFUSED[name]
    message = refusal(load, text)
    assert words in message and len(message) < 200


@pytest.mark.parametrize(
    "text",
    [
        "a: &a {x: 1}\nb: {<<: *a, y: 2}\nc: [*a, *a]",
        "[" * 40 + "]" * 40,
        "",
        "a: " + "x" * 10_000,
    ],
)
def test_what_is_meant_is_read_as_ever(text: str) -> None:
    assert load(text) == yaml.safe_load(text)
