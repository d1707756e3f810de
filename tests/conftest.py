"""What tests of all packages share."""

from collections.abc import Iterator

import pytest

from drake_disasm.common import executors
from drake_disasm.effects import find_effect, registry
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


@pytest.fixture(scope="module", autouse=True)
def library(request: pytest.FixtureRequest) -> Iterator[None]:
    """The effects that a module names in `LIBRARY` are all there are, if it does.

    A search among every effect takes ten times as long.
    """
    with pytest.MonkeyPatch.context() as patch:
        if names := getattr(request.module, "LIBRARY", None):
            few = {name: find_effect(name) for name in names}
            patch.setattr(registry, "_effects", few)
        yield
