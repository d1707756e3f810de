"""The site's own hooks: port blocks, tables of quantities, links into the code."""

import dataclasses
import importlib.util
import sys
import types

import pytest

from drake_disasm.common.quantity import quantity
from sysid.fitting.settings import SelectionSettings
from tests.docs.pages import ROOT


def _hook(name: str) -> types.ModuleType:
    path = ROOT / "docs" / "_ext" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"docs_{name}", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


docstrings, repository_links = _hook("docstrings"), _hook("repository_links")


def test_ports_become_a_table() -> None:
    block = "@system\nname: Sum\ninput_ports:\n- u\n- v\noutput_ports:\n- y\n@endsystem"
    lines = docstrings.system_block(["Adds.", "", *block.splitlines(), "", "More."])
    text = "\n".join(lines)
    assert "@" not in text and text.startswith("Adds.") and text.endswith("More.")
    assert "``u`` →" in text and "``v`` →" in text and "→ ``y``" in text
    assert "**Sum**" in text


def test_a_block_that_is_not_closed_is_refused() -> None:
    with pytest.raises(ValueError, match="@endsystem"):
        docstrings.system_block(["@system", "name: Sum"])


@dataclasses.dataclass
class _Spring:
    stiffness: float = quantity(2.5, "N/m", "of the coil", low=0.0)
    ends: str = quantity("flat", "", "how it ends", choices=("flat", "hook"))


def test_quantities_become_a_table() -> None:
    text = "\n".join(docstrings.field_table(_Spring))
    assert all(t in text for t in ("``stiffness``", "``2.5``", "N/m", "≥ 0", "coil"))
    assert "``flat``, ``hook``" in text
    assert docstrings.field_table(int) == []
    text = "\n".join(docstrings.field_table(SelectionSettings))
    names = [field.name for field in dataclasses.fields(SelectionSettings)]
    assert all(f"``{name}``" in text for name in names) and "judge" in text


#: Markdown, the folder that it stands in, its page of the site, the link there.
_LINKS = """
[m](../drake_disasm/mdp.py)              docs         a.md         reference/api/drake_disasm.mdp.rst
[s](../../sysid/models)                  docs/guides  guides/a.md  ../reference/api/sysid.models.rst
[p](docs/explanation/physics.md#contact) .            index.md     explanation/physics.md#contact
[s](models/SOURCES.md)                   .            index.md     reference/models.md
[i](../README.md#the-idea)               docs         a.md         index.md#the-idea
[h](../models/x.yaml)                    docs         a.md         ../models/x.yaml
[d](https://drake.mit.edu)               docs         a.md         https://drake.mit.edu
"""  # noqa: E501


def test_links_into_the_repository() -> None:
    for line in _LINKS.strip().splitlines():
        markdown, folder, page, expected = line.split()
        assert f"({expected})" in repository_links.rewrite(markdown, folder, page)
    rewritten = repository_links.rewrite("in [`models/`](models) here", ".", "index.md")
    assert rewritten == "in `models/` here"
