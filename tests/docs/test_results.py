"""Results: pages match their data, and a damaged file is one line with its remedy."""

import json
from pathlib import Path
from typing import Any

import pytest
import results
import results_pages
import yaml

from tests.refusals import refused

_DATA = {
    "title": "Errors",
    "columns": ["effect", "error [N]"],
    "rows": [["GroovePose", 0.5], ["a | b", 2]],
    "command": "python benchmarks/x.py --steps 3",
    "commit": "abc1234",
    "date": "2026-11-20",
    "machine": "2 cores, x86_64",
    "written_by": "benchmarks/x.py",
    "note": "",
}
_PAGE = {
    "page": "errors",
    "title": "Errors of the twin",
    "question": "How far is the twin off?",
    "reading": "Not far.",
    "limits": "None were found.",
    "data": ["errors"],
}


def _folder(
    tmp_path: Path, data: dict[str, Any] = _DATA, page: dict[str, Any] = _PAGE
) -> Path:
    folder = tmp_path / "results"
    for name in ("pages", "data"):
        (folder / name).mkdir(parents=True)
    (folder / "data" / "errors.json").write_text(json.dumps(data))
    (folder / "pages" / "errors.yaml").write_text(yaml.safe_dump(page))
    return folder


def test_pages_are_what_their_data_generate() -> None:
    remedy = "run `make results`"
    wanted = results_pages.generated(results_pages.FOLDER)
    for name, text in wanted.items():
        path = results_pages.FOLDER / name
        assert path.exists() and path.read_text("utf-8") == text, f"{path}: {remedy}"
    assert not results_pages.stale_pages(results_pages.FOLDER, wanted), remedy


def test_a_page_has_its_prose_its_tables_and_their_origin(tmp_path: Path) -> None:
    pages = results_pages.generated(_folder(tmp_path))
    text = pages["errors.md"]
    assert "# Errors of the twin\n\n**How far is the twin off?**" in text
    assert "| effect | error [N] |\n| --- | ---: |\n| GroovePose | 0.5 |" in text
    assert "| a \\| b | 2 |" in text
    assert "Commit `abc1234`, 2026-11-20, 2 cores, x86_64" in text
    assert text.endswith("## Limits\n\nNone were found.\n")
    assert "[Errors of the twin](errors.md)" in pages["index.md"]


@pytest.mark.parametrize(
    "change, key",
    [
        ({"rows": [["one"]]}, "row 1 has 1 cells for 2 columns"),
        ({"rows": [["one", None]]}, "row 1 has None"),
        ({"rows": []}, "rows are empty"),
        ({"commit": 3}, "commit"),
        ({"extra": ""}, "'extra' is unknown"),
    ],
)
def test_damaged_data_are_refused(
    tmp_path: Path, change: dict[str, Any], key: str
) -> None:
    with refused("errors.json", "--results", key):
        results_pages.generated(_folder(tmp_path, data=_DATA | change))


@pytest.mark.parametrize(
    "change, key",
    [
        ({"data": ["errors", "lost"]}, "lost.json: does not exist"),
        ({"data": []}, "errors.json: no page shows it"),
        ({"page": "other"}, "page is 'other', not 'errors'"),
        ({"questoin": "?"}, "did you mean 'question'?"),
        ({"figures": [{"file": "no.png", "alt": "", "caption": ""}]}, "no.png"),
    ],
)
def test_prose_that_does_not_match_is_refused(
    tmp_path: Path, change: dict[str, Any], key: str
) -> None:
    with refused(key):
        results_pages.generated(_folder(tmp_path, page=_PAGE | change))


@pytest.mark.parametrize(
    "text, key",
    [
        ('{"title": ', "--results"),
        ('{"title": "a", "title": "b"}', "'title' is given twice"),
    ],
)
def test_files_that_are_no_json_are_refused(
    tmp_path: Path, text: str, key: str
) -> None:
    path = tmp_path / "errors.json"
    path.write_text(text)
    with refused("errors.json", key):
        results.read_result(path)


def test_what_is_written_says_where_it_is_from(tmp_path: Path) -> None:
    path = tmp_path / "data" / "speed.json"
    table = ("Speed", ["figure", "value"], [["steps", 3.5]], "benchmarks/speed.py")
    results.write_result(path, *table, ["--only", "a b", "--results", str(path)])
    found = results.read_result(path)
    assert found.rows == (("steps", 3.5),)
    assert found.command == "python benchmarks/speed.py --only 'a b'"
    assert found.machine == results.machine() and found.commit != "unknown"
    results.write_result(None, *table, [])  # without --results nothing is written
