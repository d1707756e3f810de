"""Shows what our docstrings have beyond Google's style.

A system's ports stand in its docstring between `@system` and `@endsystem`, as in
Drake; here they become a block with inputs on the left and outputs on the right. A
dataclass whose fields state unit and meaning in their metadata gets a table of them.
"""

import dataclasses
import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import yaml

if TYPE_CHECKING:
    from docutils import nodes
    from sphinx.application import Sphinx

#: A bar outside of ``literals`` and `names`; |x| is an absolute value to us.
_BAR = re.compile(r"(``.*?``|`[^`]*`)|\|")

QUANTITY_HEAD = ("field", "default", "unit", "bounds", "meaning")
SETTING_HEAD = ("setting", "default", "unit", "reason", "measured")


def system_block(lines: Sequence[str]) -> list[str]:
    """Returns a docstring's lines with the `@system` block as reStructuredText.

    Raises:
        ValueError: the block is not closed, or is not YAML of name and ports.
    """
    stripped = [line.strip() for line in lines]
    if "@system" not in stripped:
        return list(lines)
    if "@endsystem" not in stripped:
        raise ValueError("@system without @endsystem; close the block")
    begin, end = stripped.index("@system"), stripped.index("@endsystem")
    block = yaml.safe_load("\n".join(lines[begin + 1 : end]))
    return [*lines[:begin], *_port_table(block), *lines[end + 1 :]]


def without_substitutions(lines: Sequence[str]) -> list[str]:
    """Returns a docstring's lines with |x| as text, apart from literal blocks."""
    escaped, literal = [], False
    for line in lines:
        literal = literal and (not line.strip() or line.startswith(" "))
        escaped.append(line if literal else _BAR.sub(_escaped_bar, line))
        literal = literal or line.endswith("::")
    return escaped


def literal_blocks(lines: Sequence[str]) -> list[str]:
    """Returns a docstring's lines with what is indented after "...:" as code.

    Between the two stands an empty line; the sections of Google's style have none.
    """
    marked = list(lines)
    for i in range(len(lines) - 2):
        line, blank, code = lines[i : i + 3]
        indented = _indent(code) >= _indent(line) + 4
        if line.endswith(":") and not line.endswith("::") and not blank.strip():
            marked[i] = line + ":" * indented
    return marked


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip()) if line.strip() else 0


def _escaped_bar(match: re.Match[str]) -> str:
    return match.group(1) or r"\|"


def field_table(cls: type) -> list[str]:
    """Returns a table of a dataclass's fields that explain themselves.

    Those made by `quantity` have a `doc` and bounds, those of settings a `reason` and
    what was `measured`.
    """
    lines = []
    if rows := quantity_rows(cls):
        lines += ["", *_list_table([QUANTITY_HEAD, *rows], "quantities"), ""]
    if rows := setting_rows(cls):
        table = _list_table([SETTING_HEAD, *rows], "settings", "24 9 13 32 22")
        lines += ["", *table, ""]
    return lines


def quantity_rows(cls: type) -> list[tuple[str, ...]]:
    """Returns a row for each field made by `quantity`, as QUANTITY_HEAD says."""
    return [_quantity_row(f) for f in _fields(cls) if "doc" in f.metadata]


def setting_rows(cls: type) -> list[tuple[str, ...]]:
    """Returns a row for each field made by `threshold`, as SETTING_HEAD says."""
    return [_setting_row(f) for f in _fields(cls) if "reason" in f.metadata]


def _fields(cls: type) -> tuple[dataclasses.Field[Any], ...]:
    return dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ()


def _quantity_row(field: dataclasses.Field[Any]) -> tuple[str, ...]:
    metadata = field.metadata
    bounds = (metadata.get("low", -math.inf), metadata.get("high", math.inf))
    choices = metadata.get("choices")
    return (
        *_name_default_unit(field),
        _words(choices) if choices else _range(*bounds),
        _text(metadata["doc"]),
    )


def _setting_row(field: dataclasses.Field[Any]) -> tuple[str, ...]:
    reason, measured = field.metadata["reason"], field.metadata.get("measured", "")
    return (*_name_default_unit(field), _text(reason), _text(measured))


def _name_default_unit(field: dataclasses.Field[Any]) -> tuple[str, str, str]:
    default = field.default
    if field.default_factory is not dataclasses.MISSING:
        default = field.default_factory()
    shown = "" if default is dataclasses.MISSING else f"``{default!r}``"
    return f"``{field.name}``", shown, _text(field.metadata.get("unit", ""))


def _text(value: Any) -> str:
    return str(value).replace("*", r"\*").replace("|", r"\|")


def _words(choices: Sequence[str]) -> str:
    return ", ".join(f"``{word}``" for word in choices)


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return ""
    if math.isinf(high):
        return f"≥ {low:g}"
    return f"≤ {high:g}" if math.isinf(low) else f"{low:g} to {high:g}"


def _port_table(block: dict[str, Any]) -> list[str]:
    inputs, outputs = block.get("input_ports") or [], block.get("output_ports") or []
    names = [[f"``{name}`` →" for name in inputs], [f"→ ``{n}``" for n in outputs]]
    cells = ["| ".join(["", *(f"{n}\n" for n in column)]) for column in names]
    rows = [("inputs", "", "outputs"), (cells[0], f"**{block['name']}**", cells[1])]
    return ["", *_list_table(rows, "ports"), ""]


def _list_table(
    rows: Sequence[Sequence[str]], css_class: str, widths: str = "auto"
) -> list[str]:
    lines = [".. list-table::", f"   :class: {css_class}", f"   :widths: {widths}"]
    lines += ["   :header-rows: 1", ""]
    for row in rows:
        for i, cell in enumerate(row):
            first, *more = cell.split("\n")
            lines.append(f"   {'*' if i == 0 else ' '} - {first}".rstrip())
            lines += [f"       {line}".rstrip() for line in more]
    return lines


def _process(
    app: "Sphinx", what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    if getattr(obj, "__module__", "") == "typing":  # an alias has typing's docstring
        lines.clear()
    lines[:] = system_block(without_substitutions(literal_blocks(lines)))
    if what == "class":
        lines += field_table(obj)


def _tidy(app: "Sphinx", doctree: "nodes.document") -> None:
    """Tidies a page of the reference, before its table of contents is collected.

    Attributes are called so; that a class is an object is left out; in the sidebar a
    module has its own name, without those of its packages.
    """
    for node in list(doctree.findall()):
        if node.tagname == "toctree":
            node["entries"] = [(_short(*entry), entry[1]) for entry in node["entries"]]
        elif node.tagname == "paragraph" and node.astext() == "Bases: object":
            node.parent.remove(node)
        elif node.tagname == "field_name" and node.astext() == "Variables":
            node[0] = type(node[0])("Attributes")


def _short(title: str | None, page: str) -> str | None:
    return page.rpartition(".")[2] if "api/" in page and "." in page else title


def setup(app: "Sphinx") -> dict[str, bool]:
    """Registers the hooks; that on docstrings comes before napoleon's."""
    app.connect("autodoc-process-docstring", _process, priority=400)
    app.connect("doctree-read", _tidy, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
