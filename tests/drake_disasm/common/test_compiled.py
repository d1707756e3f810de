"""Compiled functions: what Numba keeps is never stale."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[3]
FILES = [
    file
    for part in ("drake_disasm", "sysid")
    for file in (ROOT / part).rglob("*.py")
    if "@compiled" in file.read_text()
]


def test_compiled_functions_use_nothing_of_ours_from_other_files() -> None:
    """Numba compares a function's own file with what it has kept, and no other."""
    assert [file.name for file in FILES] == ["equations.py"]
    for node in ast.parse(FILES[0].read_text()).body:
        if isinstance(node, ast.ImportFrom) and "drake_disasm" in (node.module or ""):
            assert [alias.name for alias in node.names] == ["compiled"]
