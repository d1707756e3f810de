"""Writes docs/results: a page for each file of prose, with the tables of its data.

`python benchmarks/results_pages.py` (or `make results`) reads docs/results/pages/*.yaml
and docs/results/data/*.json, and writes docs/results/*.md. A page's keys:

    page: verdicts          # the file's own name
    title: Verdicts on logs with hidden effects
    question: Does close-loop name the effect that was hidden?
    reading: what the tables say
    limits: when not to trust it, and what failed
    data: [verdicts_cell]   # docs/results/data/verdicts_cell.json
    figures: [{file: confusion.png, alt: ..., caption: ...}]   # of docs/images
"""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from results import Result, markdown, read_result

from drake_disasm.common import bounded_yaml, program
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text, write_text
from drake_disasm.common.plain_data import check_like
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped

FOLDER = Path(__file__).parents[1] / "docs" / "results"

_MOST_BYTES = 2**16
_GENERATED = "<!-- Written by `make results` from pages/{}; edit that. -->"
_INDEX = """<!-- Written by `make results`. -->

# Results

Each page asks a question and answers it with tables that a program measured. Below a
table stand the command that repeats it, the commit, the date and the machine.

| page | question |
|---|---|
{rows}

```{{toctree}}
:hidden:

{names}
```
"""


@dataclasses.dataclass(frozen=True)
class Figure:
    """A picture on a page.

    Attributes:
        file: in docs/images.
        alt: what it shows, for who can't see it.
        caption: a sentence below it.
    """

    file: str
    alt: str
    caption: str


@dataclasses.dataclass(frozen=True)
class Page:
    """The prose of a page, and which tables and figures are on it.

    Attributes:
        page: its name, without ending.
        title: its heading.
        question: that the tables answer.
        reading: what they say.
        limits: when not to trust it, and what failed.
        data: names of files in docs/results/data.
        figures: below the tables.
    """

    page: str
    title: str
    question: str
    reading: str
    limits: str
    data: tuple[str, ...]
    figures: tuple[Figure, ...] = ()


def main(arguments: Sequence[str]) -> int:
    """Writes the pages, and removes those whose prose is gone."""
    parser = program.argument_parser("python benchmarks/results_pages.py", __doc__, "")
    parser.parse_args(arguments)
    written = generated(FOLDER)
    for name, text in written.items():
        write_text(FOLDER / name, text)
    for stale in stale_pages(FOLDER, written):
        stale.unlink()
    print(f"{FOLDER}: {len(written)} pages")
    return 0


def generated(folder: Path) -> dict[str, str]:
    """Returns the Markdown of all pages and their index, by file name.

    Args:
        folder: with pages/ and data/; its pictures are in ../images.

    Raises:
        DisasmError: prose or data are damaged, or do not match each other.
    """
    pages = [read_page(path) for path in sorted((folder / "pages").glob("*.yaml"))]
    _check_all_are_shown(folder, pages)
    texts = {f"{page.page}.md": _text(folder, page) for page in pages}
    return texts | {"index.md": _index(pages)}


def stale_pages(folder: Path, wanted: Iterable[str]) -> list[Path]:
    """Returns the pages in a folder that are not among the wanted ones."""
    return [path for path in sorted(folder.glob("*.md")) if path.name not in wanted]


def read_page(path: Path) -> Page:
    """Returns the prose in a file.

    Raises:
        DisasmError: it can't be read, or its keys are not those of `Page`.
    """
    remedy = "correct it as benchmarks/results_pages.py --help says"
    text = read_text(path, remedy, _MOST_BYTES)
    try:
        page = _parsed(bounded_yaml.load(text))
        if page.page != path.stem:
            raise DisasmError(f"page is '{clipped(page.page)}', not '{path.stem}'")
    except DisasmError as error:
        raise DisasmError(f"{path}: {error}; {remedy}") from None
    return page


def _parsed(content: Any) -> Page:
    texts = dict.fromkeys(("page", "title", "question", "reading", "limits"), "")
    check_like(content, texts | {"data": [""]})
    pictures = content.get("figures", [])
    check_like(pictures, [dict.fromkeys(_names(Figure), "")], "figures")
    _check_keys(content, Page)
    for picture in pictures:
        _check_keys(picture, Figure)
    figures = tuple(Figure(**picture) for picture in pictures)
    fields: dict[str, Any] = {key: _one_line(content[key]) for key in texts}
    return Page(**fields, data=tuple(content["data"]), figures=figures)


def _names(schema: type) -> list[str]:
    return [field.name for field in dataclasses.fields(schema)]


def _check_keys(content: dict[Any, Any], schema: type) -> None:
    for key in content:
        if key not in _names(schema):
            hint = closest(str(key), _names(schema))
            raise DisasmError(f"key '{clipped(str(key))}' is unknown; {hint}")


def _one_line(text: str) -> str:
    """Returns paragraphs, each as one line."""
    return "\n\n".join(" ".join(part.split()) for part in text.strip().split("\n\n"))


def _check_all_are_shown(folder: Path, pages: Sequence[Page]) -> None:
    named = {name for page in pages for name in page.data}
    for path in sorted((folder / "data").glob("*.json")):
        if path.stem not in named:
            raise DisasmError(
                f"{path}: no page shows it; list '{path.stem}' under data of a page in "
                f"{folder / 'pages'}, or remove it"
            )


def _text(folder: Path, page: Page) -> str:
    """Returns a page as Markdown."""
    parts = [_GENERATED.format(f"{page.page}.yaml"), f"# {page.title}"]
    parts += [f"**{page.question}**", page.reading]
    for name in page.data:
        parts += _table(_data(folder, page, name))
    for figure in page.figures:
        parts += _picture(folder, page, figure)
    return "\n\n".join([*parts, "## Limits", page.limits]) + "\n"


def _data(folder: Path, page: Page, name: str) -> Result:
    path = folder / "data" / f"{name}.json"
    if not path.exists():
        raise DisasmError(
            f"{path}: does not exist, and pages/{page.page}.yaml shows it; write it by "
            "the benchmark's --results, or take it off the page"
        )
    return read_result(path)


def _table(result: Result) -> Iterator[str]:
    """Yields a result's heading, table, note and origin."""
    yield f"## {result.title}"
    yield markdown(result.columns, result.rows)
    if result.note:
        yield result.note
    yield _origin(result)


def _origin(result: Result) -> str:
    """Returns how the measurement can be repeated, and what it was made on."""
    program_or_source = result.written_by
    if not program_or_source.startswith("transcribed"):
        program_or_source = f"written by `{program_or_source}`"
    date, machine = (
        f"{name} not recorded" if value == "not recorded" else value
        for name, value in (("date", result.date), ("machine", result.machine))
    )
    return (
        f'<div class="origin">\n\n`{result.command}`\n\nCommit `{result.commit}`, '
        f"{date}, {machine}; {program_or_source}.\n\n</div>"
    )


def _picture(folder: Path, page: Page, figure: Figure) -> list[str]:
    path = folder.parent / "images" / figure.file
    if not path.is_file():
        raise DisasmError(
            f"{path}: does not exist, and pages/{page.page}.yaml shows it; draw it, or "
            "take it off the page"
        )
    return [f"![{figure.alt}](../images/{figure.file})", f"*{figure.caption}*"]


def _index(pages: Sequence[Page]) -> str:
    ordered = sorted(pages, key=lambda page: page.title)
    rows = "\n".join(f"| [{p.title}]({p.page}.md) | {p.question} |" for p in ordered)
    names = "\n".join(page.page for page in ordered)
    return _INDEX.format(rows=rows, names=names)


if __name__ == "__main__":
    program.run(main)
