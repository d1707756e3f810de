"""Links lead somewhere, and every file, module and member that a page names exists."""

import ast
import functools
import importlib
import re

from tests.docs.pages import ROOT, anchors, links, literals, name_of, pages

_FOLDERS = ("benchmarks", "docs", "drake_disasm", "examples", "models", "sysid")
_PATH = re.compile(rf"(?:{'|'.join((*_FOLDERS, 'tests', 'tools'))})/[\w./*-]*")
_DOTTED = re.compile(r"(?:drake_disasm|sysid|tests|benchmarks)(?:\.\w+)+")
_MEMBER = re.compile(r"([A-Z]\w+)\.(\w+)(?:\(.*\))?")
_SOURCES = [f for top in ("drake_disasm", "sysid") for f in (ROOT / top).rglob("*.py")]
_RESULTS = ROOT / "docs" / "results"
#: Look like paths: the schema of logs, ids of Gymnasium.
_NO_PATH = re.compile(r"drake_disasm/(log/1|\w+-v\d)")


def test_links_lead_somewhere() -> None:
    for page, link in ((p, link) for p in pages() for link in links(p)):
        if "://" in link:
            continue
        target, _, anchor = link.partition("#")
        file = (page.parent / target).resolve() if target else page
        assert file.exists(), f"{name_of(page)} links to {link}"
        if anchor:
            assert anchor in anchors(file), f"{name_of(page)} links to {link}"


def test_named_files_modules_and_members_exist() -> None:
    # Pages of results name what was there at the commits of their measurements.
    checked = [page for page in pages() if page.parent != _RESULTS]
    for page, literal in ((p, literal) for p in checked for literal in literals(p)):
        for path in _PATH.findall(literal):
            exists = _NO_PATH.match(path) or any(ROOT.glob(path.rstrip("/.")))
            assert exists, f"{name_of(page)}: {path}"
        if _DOTTED.fullmatch(literal):
            assert _resolves(literal), f"{name_of(page)}: {literal}"
        elif match := _MEMBER.fullmatch(literal):
            assert _has_member(*match.groups()), f"{name_of(page)}: {literal}"


def _resolves(dotted: str) -> bool:
    module, names = dotted, []
    while module:
        try:
            found = importlib.import_module(module)
        except ModuleNotFoundError:
            module, _, name = module.rpartition(".")
            names.insert(0, name)
            continue
        for name in names:
            found = getattr(found, name, None)
        return found is not None
    return False


def _has_member(cls: str, member: str) -> bool:
    """Whether one of our classes of that name has the member; other people's pass."""
    modules = _classes().get(cls)
    if modules is None:
        return True
    found = [getattr(importlib.import_module(module), cls) for module in modules]
    return any(
        hasattr(c, member) or member in getattr(c, "__dataclass_fields__", ())
        for c in found
    )


@functools.cache
def _classes() -> dict[str, list[str]]:
    classes: dict[str, list[str]] = {}
    for file in _SOURCES:
        module = ".".join(file.relative_to(ROOT).with_suffix("").parts)
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, ast.ClassDef):
                classes.setdefault(node.name, []).append(module)
    return classes
