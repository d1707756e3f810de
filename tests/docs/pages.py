"""The pages that a reader sees: their code blocks, links and names."""

import dataclasses
import functools
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.anchors import anchors_plugin

ROOT = Path(__file__).parents[2]
_GENERATED = ROOT / "docs" / "reference" / "api"
_OPERATORS = {"|", "||", "&", "&&", ";", "\n"}
_REDIRECTIONS = {">", ">>", "<", "2>"}


def pages() -> list[Path]:
    """Returns README, everything under docs/, and the pages of models/."""
    written = (p for p in (ROOT / "docs").rglob("*.md") if _GENERATED not in p.parents)
    models = (ROOT / "models").rglob("*.md")
    return [ROOT / "README.md", *sorted(written), *sorted(models)]


def name_of(page: Path) -> str:
    """Returns a page's path in the repository."""
    return page.relative_to(ROOT).as_posix()


@functools.cache
def tokens(page: Path) -> tuple[Token, ...]:
    """Returns a page's Markdown as tokens; headings carry their anchor as id."""
    parser = MarkdownIt("commonmark").enable("table")
    parser.use(anchors_plugin, max_level=3)
    return tuple(_flattened(parser.parse(page.read_text("utf-8"))))


def _flattened(found: list[Token]) -> Iterator[Token]:
    for token in found:
        yield token
        yield from _flattened(token.children or [])


@dataclasses.dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        page: that it stands on.
        line: of its first line of code, from 1.
        language: first word after the fence.
        text: between the fences.
    """

    page: Path
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        """Returns where it stands."""
        return f"{name_of(self.page)}:{self.line}"


def blocks(page: Path, *languages: str) -> list[Block]:
    """Returns the blocks of a page in some languages."""
    return [
        Block(page, token.map[0] + 2, token.info.split()[0], token.content)
        for token in tokens(page)
        if token.type == "fence" and token.map and token.info.split()
        if token.info.split()[0] in languages
    ]


def links(page: Path) -> list[str]:
    """Returns the targets of a page's links and pictures."""
    targets = (t.attrGet("href") or t.attrGet("src") for t in tokens(page))
    return [str(target) for target in targets if target]


def anchors(page: Path) -> set[str]:
    """Returns the anchors of a page's headings."""
    headings = (t.attrGet("id") for t in tokens(page) if t.type == "heading_open")
    return {str(anchor) for anchor in headings if anchor}


def literals(page: Path) -> list[str]:
    """Returns what a page shows as `code` within its text."""
    return [token.content for token in tokens(page) if token.type == "code_inline"]


def commands(text: str) -> list[list[str]]:
    """Returns the simple commands of a shell block, as words.

    Here-documents and redirections are left out. The variable of a `for` loop has
    its first value.
    """
    text = re.sub(r"<<(\w+)\n.*?\n\1$", "", text, flags=re.S | re.M)
    found = []
    values: dict[str, str] = {}
    for words in _split(text.replace("\\\n", " ")):
        if words[0] == "for":
            values[f"${words[1]}"] = words[3]
        words = [_filled(word, values) for word in words if word not in ("do", "done")]
        if words and words[0] != "for":
            found.append(words)
    return found


def _filled(word: str, values: dict[str, str]) -> str:
    for variable, value in values.items():
        word = word.replace(variable, value)
    return word


def _split(text: str) -> Iterator[list[str]]:
    for line in text.splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
        lexer.whitespace_split = True
        words: list[str] = []
        lexed = iter(lexer)
        for word in lexed:
            if word in _REDIRECTIONS:
                next(lexed)
            elif word in _OPERATORS:
                yield words
                words = []
            else:
                words.append(word)
        if words:
            yield words
