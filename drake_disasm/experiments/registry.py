"""Which experiments there are: the library's own and those that users add."""

import dataclasses
from typing import TypeVar

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import import_in_workers
from drake_disasm.common.quantity import closest
from drake_disasm.experiments.base import AnyExperiment, Experiment, JointExperiment

_Kind = TypeVar("_Kind", bound=type[AnyExperiment])
_experiments: dict[str, type[AnyExperiment]] = {}


def register_experiment(experiment: _Kind) -> _Kind:
    """Adds an experiment; a class decorator, above `@dataclasses.dataclass`.

    Raises:
        DisasmError: not a complete experiment, or another one has its name.
    """
    name = experiment.__name__
    missing = ", ".join(sorted(getattr(experiment, "__abstractmethods__", ())))
    if missing:
        raise DisasmError(f"experiment {name}: lacks {missing}; define it")
    for field in dataclasses.fields(experiment):
        if "unit" not in field.metadata:
            raise DisasmError(
                f"experiment {name}: declare {field.name} by `quantity`, and put "
                "@dataclasses.dataclass(frozen=True) above the class"
            )
    other = _experiments.get(name)
    if other is not None and other.__module__ != experiment.__module__:
        raise DisasmError(
            f"experiment {name}: {other.__module__} has one of that name; rename it"
        )
    _experiments[name] = experiment
    if not experiment.__module__.startswith("drake_disasm."):
        import_in_workers(experiment.__module__)
    return experiment


def registered_experiments() -> tuple[type[Experiment], ...]:
    """Returns experiments in contact: the library's in the manual's order, others."""
    return tuple(k for k in _experiments.values() if issubclass(k, Experiment))


def registered_joint_experiments() -> tuple[type[JointExperiment], ...]:
    """Returns experiments of an arm in free space, in the same order."""
    return tuple(k for k in _experiments.values() if issubclass(k, JointExperiment))


def find_experiment(name: str) -> type[AnyExperiment]:
    """Returns the experiment of a name.

    Raises:
        DisasmError: there is none.
    """
    if name not in _experiments:
        raise DisasmError(
            f"experiment '{name}' does not exist; {closest(name, list(_experiments))}"
        )
    return _experiments[name]
