"""Fields that know their bounds, and what breaks them, in words."""

import dataclasses
import math

import pytest

from drake_disasm.common.quantity import check, closest, quantity
from tests.refusals import refusal


@dataclasses.dataclass
class _Inner:
    mass: float = quantity(1.0, "kg", "a mass", low=0.5, high=2.0)


@dataclasses.dataclass
class _Outer:
    word: str = quantity("a", "", "a word", choices=("a", "b"))
    free: float = quantity(0.0, "m", "without bounds")
    values: list[float] = quantity([1.0, 2.0], "N", "two forces", low=-3.0, high=3.0)
    inner: _Inner = dataclasses.field(default_factory=_Inner)
    many: list[_Inner] = dataclasses.field(default_factory=list)


def test_defaults_pass_and_are_not_shared() -> None:
    check(_Outer())
    check(_Outer(values=[-3.0, 3.0], inner=_Inner(0.5), many=[_Inner(2.0)]))
    first, second = _Outer(), _Outer()
    first.values.append(9.0)
    assert second.values == [1.0, 2.0]


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (_Outer(inner=_Inner(0.4)), ["inner.mass", "0.4 kg", "0.5 to 2"]),
        (_Outer(free=math.nan), ["free", "nan"]),
        (_Outer(values=[1.0, 3.1]), ["values", "3.1 N", "-3 to 3"]),
        (_Outer(values=[1.0]), ["values", "1 values given, 2 needed"]),
        (_Outer(word="c"), ["word", "'c'", "'a'", "'b'"]),
        (_Outer(many=[_Inner(), _Inner(9.0)]), ["many.1.mass", "9 kg"]),
    ],
)
def test_first_broken_field_is_named(config: _Outer, words: list[str]) -> None:
    message = refusal(check, config, "here")
    assert message.startswith(f"here.{words[0]}:")
    assert all(word in message for word in words), message


def test_closest_suggests_or_lists() -> None:
    assert closest("frction", ["friction", "weld"]) == "did you mean 'friction'?"
    assert closest("xyz", ["friction", "weld"]) == "known: friction, weld"
