"""How bad input is refused: in one line that names what is wrong and a remedy."""

import contextlib
from collections.abc import Callable, Iterator

import pytest

from drake_disasm.common.errors import DisasmError


def refusal(call: Callable[..., object], *arguments: object, **options: object) -> str:
    """Returns the one line in which a call is refused; fails if it isn't."""
    try:
        call(*arguments, **options)
    except DisasmError as error:
        message = str(error)
    else:
        pytest.fail(f"not refused: {str((arguments, options))[:500]}")
    assert "\n" not in message and len(message) < 1500, message
    return message


@contextlib.contextmanager
def refused(*words: object) -> Iterator[None]:
    """Expects a refusal in one line that has all of these words in it."""
    with pytest.raises(DisasmError) as caught:
        yield
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert str(word) in message, message
