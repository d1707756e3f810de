"""Compiled functions: what Numba keeps is never stale."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
FILES = [
    file
    for part in ("drake_disasm", "sysid")
    for file in (ROOT / part).rglob("*.py")
    if "@compiled" in file.read_text()
]


def _compiled(tree: ast.Module) -> list[ast.FunctionDef]:
    return [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(getattr(d, "id", "") == "compiled" for d in node.decorator_list)
    ]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_compiled_functions_use_nothing_of_ours_from_other_files(file: Path) -> None:
    """Numba compares a function's own file with what it has kept, and no other."""
    tree = ast.parse(file.read_text())
    imported = {
        alias.asname or alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and "drake_disasm" in (node.module or "")
        for alias in node.names
    } - {"compiled"}
    functions = _compiled(tree)
    used = {n.id for f in functions for n in ast.walk(f) if isinstance(n, ast.Name)}
    assert functions and not used & imported


def test_there_are_compiled_functions() -> None:
    assert [file.name for file in FILES] == ["equations.py"]
