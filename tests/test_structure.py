"""The house's rules: which package may import which."""

import ast
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

#: Rooms of drake_disasm from the ground up; a module imports from its own or lower.
FLOORS = (
    {"common"},
    {"effects"},
    {"scenario", "ports"},
    {"mdp", "cell", "logs"},
    {"impact", "devices"},
    {"safety"},
    {"systems"},
    {"stations", "policies"},
    {"task"},
    {"visualization", "learning", "fakes"},
    {"studies"},
)
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
MODULES = sorted((ROOT / "drake_disasm").rglob("*.py"))


def _imports(file: Path) -> set[str]:
    tree = ast.parse(file.read_text())
    names = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return names


@pytest.mark.parametrize("file", MODULES, ids=lambda f: str(f.relative_to(ROOT)))
def test_arrows_point_down(file: Path) -> None:
    room = file.relative_to(ROOT / "drake_disasm").parts[0].removesuffix(".py")
    for name in _imports(file):
        package, *rest = name.split(".")
        assert package not in {"sysid", "tools", "tests"}, name
        if package == "drake_disasm" and rest and room != "__init__":
            assert FLOOR[rest[0]] <= FLOOR[room], f"{room} imports {name}"


def test_sysid_does_not_import_tools() -> None:
    for file in (ROOT / "sysid").rglob("*.py"):
        packages = {name.split(".")[0] for name in _imports(file)}
        assert not packages & {"tools", "tests"}, file


def test_every_package_is_installed() -> None:
    with (ROOT / "pyproject.toml").open("rb") as stream:
        listed = tomllib.load(stream)["tool"]["setuptools"]["packages"]
    found = {
        ".".join(file.parent.relative_to(ROOT).parts)
        for top in ("drake_disasm", "sysid")
        for file in (ROOT / top).rglob("__init__.py")
    }
    assert found | {"disasm_models"} == set(listed)
