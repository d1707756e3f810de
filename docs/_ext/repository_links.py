"""Lets pages link to files of the repository, as they must to work on a code host.

A link from a page to `../drake_disasm/mdp.py` leads to the module's page of the API
reference, one to a page that the site includes from elsewhere (SOURCES.md) to that
page, and one to any other file to a copy of the file.
"""

import posixpath
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
_DOCS = "docs"
_LINK = re.compile(r"(?<!!)(\[[^\]\[]*\])\(([^)\s:#]+)(#[^)\s]*)?\)")

#: Files outside docs/ that are pages of the site.
INCLUDED = {
    "README.md": "index.md",
    "models/SOURCES.md": "reference/models.md",
    "models/policies/README.md": "reference/policies.md",
}


def site_target(target: str, folder: str) -> str | None:
    """Returns where the site has what a page links to, relative to docs/.

    None for a folder that is no package: there is nothing to show but its name.

    Args:
        target: of the link, relative to `folder`.
        folder: of the Markdown file, relative to the repository's root.
    """
    path = posixpath.normpath(posixpath.join(folder, target))
    if path in INCLUDED:
        return INCLUDED[path]
    if path.startswith(("drake_disasm", "sysid")) and not Path(path).suffix:
        return f"reference/api/{path.replace('/', '.')}.rst"
    if path.startswith(("drake_disasm/", "sysid/")) and path.endswith(".py"):
        name = path.removesuffix(".py").removesuffix("/__init__")
        return f"reference/api/{name.replace('/', '.')}.rst"
    if (ROOT / path).is_dir():
        return None
    return posixpath.relpath(path, _DOCS)


def rewrite(text: str, folder: str, page: str) -> str:
    """Returns a page's Markdown with its links as the site needs them.

    Args:
        text: Markdown.
        folder: of the Markdown file, relative to the repository's root.
        page: of the site that shows it, relative to docs/.
    """

    def replaced(match: re.Match[str]) -> str:
        """Returns one link as the site needs it."""
        label, target, anchor = match.groups()
        found = site_target(target, folder)
        if found is None:
            return label[1:-1]
        here = posixpath.relpath(found, posixpath.dirname(page) or ".")
        return f"{label}({here}{anchor or ''})"

    return _LINK.sub(replaced, text)


def _source_read(app: "Sphinx", page: str, source: list[str]) -> None:
    if not page.startswith("reference/api/"):
        folder = posixpath.join(_DOCS, posixpath.dirname(page))
        source[0] = rewrite(source[0], folder, page)


def _include_read(app: "Sphinx", path: Path, _: str, source: list[str]) -> None:
    file = (Path(app.srcdir) / path).resolve().relative_to(ROOT).as_posix()
    # The page that MyST names lacks its folder.
    page = INCLUDED.get(file, "index.md")
    source[0] = rewrite(source[0], posixpath.dirname(file), page)


def setup(app: "Sphinx") -> dict[str, bool]:
    """Registers the hooks on what is read."""
    app.connect("source-read", _source_read)
    app.connect("include-read", _include_read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
