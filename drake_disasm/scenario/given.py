"""A scenario as a caller may give it."""

from pathlib import Path

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario.files import load_scenario
from drake_disasm.scenario.schema import Scenario


def scenario_of(given: Scenario | str | Path) -> Scenario:
    """Returns the scenario that is given as an object, a shipped name, or a file.

    Raises:
        DisasmError: it is something else; or as of `load_scenario`.
    """
    if isinstance(given, Scenario):
        return given
    if not isinstance(given, str | Path):
        raise DisasmError(
            f"scenario: is a {type(given).__name__}; give a Scenario, the name of a "
            "shipped one, or a file"
        )
    return load_scenario(str(given))
