"""Gymnasium ids of the task, registered without loading Drake.

Gymnasium 1.0 and later load no plugins, so `import drake_disasm` registers the ids, or
`gymnasium.make("drake_disasm:drake_disasm/Removal-v0")`, which imports it. What they
name is imported when an environment is made.
"""

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

#: Registered ids and the scenario of each.
IDS = {
    "drake_disasm/Removal-v0": "removal",
    "drake_disasm/RemovalTurned-v0": "removal_turned",
    "drake_disasm/RemovalRandomised-v0": "removal_randomised",
    "drake_disasm/Chapter3-v0": "chapter3",
    "drake_disasm/Chapter3Impedance-v0": "chapter3_impedance",
    "drake_disasm/Chapter3Stiff-v0": "chapter3_stiff",
    "drake_disasm/Chapter4-v0": "chapter4",
    "drake_disasm/Chapter4Impedance-v0": "chapter4_impedance",
    "drake_disasm/Chapter4Stiff-v0": "chapter4_stiff",
    "drake_disasm/Chapter5-v0": "chapter5",
    "drake_disasm/Chapter5Impedance-v0": "chapter5_impedance",
    "drake_disasm/Chapter5Stiff-v0": "chapter5_stiff",
}


def register_environments() -> None:
    """Registers all ids at once, or as soon as gymnasium is imported.

    Gymnasium is not imported here: programs that never make an environment start
    without it, and set up NumPy's threads before NumPy is loaded.
    """
    if "gymnasium" in sys.modules:
        _register()
    else:
        sys.meta_path.insert(0, _GymnasiumFinder())


def _register() -> None:
    from gymnasium.envs.registration import register, registry

    for name, scenario in IDS.items():
        if name not in registry:
            register(
                name,
                entry_point="drake_disasm.learning.environment:DisassemblyEnv",
                vector_entry_point=(
                    "drake_disasm.learning.vector_environment:DisassemblyVectorEnv"
                ),
                kwargs={"scenario": scenario},
            )


class _GymnasiumFinder:
    """Finds gymnasium as Python does, and has it register the ids once it has run."""

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None = None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """Returns gymnasium's spec; None for any other module."""
        if name != "gymnasium":
            return None
        others = (finder for finder in sys.meta_path if finder is not self)
        found = (finder.find_spec(name, path, target) for finder in others)
        spec = next((spec for spec in found if spec), None)
        if spec and spec.loader:
            self._register_after(spec.loader)
        return spec

    def _register_after(self, loader: Any) -> None:
        """Has a loader register the ids after it has run its module."""
        execute = loader.exec_module

        def exec_module(module: ModuleType) -> None:
            """Runs gymnasium, then registers."""
            execute(module)
            if self in sys.meta_path:
                sys.meta_path.remove(self)
            _register()

        loader.exec_module = exec_module
