"""What tests of all packages share."""

import contextlib
from collections.abc import Iterator

import pytest

from drake_disasm.common import executors
from drake_disasm.effects import Effect, registry
from sysid.residuals import predictable_residual

_LEARNER = predictable_residual.Learner()
_QUICK_LEARNER = predictable_residual.Learner(rate=0.5, trees=8)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Slow proofs have the learner of users; others have one of a fifth of the time.

    A closed loop spends a third of its time on the learner, which the tests of
    `sysid.residuals` are of.
    """
    is_whole = item.get_closest_marker("slow") or item.path.parent.name == "residuals"
    predictable_residual.LEARNER = _LEARNER if is_whole else _QUICK_LEARNER


@pytest.fixture
def own_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """Effects that a test registers or imports are gone after it."""
    registry.registered_effects()  # loads what entry points name
    monkeypatch.setattr(registry, "_effects", dict(registry._effects))
    monkeypatch.setattr(executors, "_modules", dict(executors._modules))


@contextlib.contextmanager
def library_of(*effects: type[Effect]) -> Iterator[None]:
    """No other effects are registered: a search among all takes ten times as long."""
    registry.registered_effects()  # loads what entry points name
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_effects", {kind.__name__: kind for kind in effects})
        yield
