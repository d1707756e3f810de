"""docs/effects.md lists the library exactly as it is."""

import dataclasses
import importlib.util
from pathlib import Path

from drake_disasm.effects import GroovePose, registered_effects
from drake_disasm.effects.documentation import documentation

_SCRIPT = Path(__file__).parents[1] / "docs" / "effects_table.py"


def test_the_page_is_what_the_registry_generates():
    spec = importlib.util.spec_from_file_location("effects_table", _SCRIPT)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    remedy = "run `python docs/effects_table.py`"
    assert script.PAGE.read_text("utf-8") == script.page(), remedy


def test_every_effect_is_there_with_all_its_fields():
    text = documentation(registered_effects())
    for effect in registered_effects():
        _, _, entry = text.partition(f"### `{effect.__name__}`")
        entry = entry.partition("### ")[0]
        assert entry.count("\n| `") == len(dataclasses.fields(effect))
        assert "```text" in entry and "Where it acts: " in entry
        assert "Revealed by: " in entry


def test_a_field_has_its_unit_and_bounds():
    row = "| `ry` | amplitude | rad | -0.2 | 0.2 | rotation about the plate's normal |"
    assert row in documentation([GroovePose])
