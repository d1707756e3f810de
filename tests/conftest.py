"""What tests of all packages share."""

import pytest

from drake_disasm.common import executors
from drake_disasm.effects import registry


@pytest.fixture
def own_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """Effects that a test registers or imports are gone after it."""
    registry.registered_effects()  # loads what entry points name
    monkeypatch.setattr(registry, "_effects", dict(registry._effects))
    monkeypatch.setattr(executors, "_modules", dict(executors._modules))
