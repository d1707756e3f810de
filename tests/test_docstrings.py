"""Public names explain themselves."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PARTS = ("drake_disasm", "sysid", "tools", "benchmarks")
FILES = [f for p in PARTS for f in (ROOT / p).rglob("*.py")]


def _is_overload(node: ast.FunctionDef | ast.ClassDef) -> bool:
    """Whether it is another signature of a function that explains itself."""
    return any(ast.unparse(name) == "overload" for name in node.decorator_list)


def _public(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    for node in ast.walk(tree):
        is_name = isinstance(node, ast.FunctionDef | ast.ClassDef)
        if not is_name or node.name.startswith("_") or _is_overload(node):
            continue
        yield node


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(ROOT)))
def test_public_names_have_docstrings(file: Path) -> None:
    tree = ast.parse(file.read_text())
    assert ast.get_docstring(tree), file
    missing = [node.name for node in _public(tree) if not ast.get_docstring(node)]
    assert not missing
