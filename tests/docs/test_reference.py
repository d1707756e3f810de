"""Pages of the reference are what the code says, with every field and option."""

import argparse
import dataclasses
import importlib
import sys

import pytest
from drake_disasm_cli.main import SUBCOMMANDS

from drake_disasm.effects import registered_effects
from drake_disasm.effects.documentation import documentation
from tests.docs.pages import ROOT


@pytest.fixture(scope="module")
def reference():
    """Returns the script that writes the pages."""
    folder = str(ROOT / "docs" / "_ext")
    sys.path.insert(0, folder)
    yield importlib.import_module("reference_pages")
    sys.path.remove(folder)


def test_pages_are_what_the_code_generates(reference):
    for name, text in reference.pages().items():
        page = reference.FOLDER / name
        assert page.read_text("utf-8") == text, f"{page}: run `make reference`"


def test_every_effect_is_there_with_all_its_fields():
    text = documentation(registered_effects())
    for effect in registered_effects():
        _, _, entry = text.partition(f"### `{effect.__name__}`")
        entry = entry.partition("### ")[0]
        assert entry.count("\n| `") == len(dataclasses.fields(effect))
        assert "```text" in entry and "Where it acts: " in entry
        assert "Revealed by: " in entry


def test_a_command_has_all_its_arguments(reference):
    page = reference.pages()["command-line.md"]
    for name in SUBCOMMANDS:
        section = page.partition(f"### {name}\n")[2].partition("\n### ")[0]
        actions = reference.parser_of(name)._actions
        shown = [a for a in actions if a.help != argparse.SUPPRESS and a.dest != "help"]
        assert section.count("\n| `") == len(shown) > 2
        assert all(a.option_strings[0] in section for a in shown if a.option_strings)
