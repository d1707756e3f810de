"""Mutants are small, stay where their function is, and are counted."""

import json
from pathlib import Path

import mutants

_MODULE = """class A:
    def f(self, x):
        if x < 2:
            print(-x)
        return x + 1.5
"""


def test_each_mutant_of_a_function_is_one_change_that_compiles(tmp_path: Path) -> None:
    (tmp_path / "sysid").mkdir()
    (tmp_path / "sysid/a.py").write_text(_MODULE)
    found = mutants.all_mutants(tmp_path)
    texts = {mutants.mutated(_MODULE, each)[0] for each in found}
    changed = [set(t.splitlines()) ^ set(_MODULE.splitlines()) for t in texts]
    assert len(texts) == len(found) == 8
    assert all(compile(t, "a", "exec") for t in texts) and max(map(len, changed)) == 2
    for line in ("if (x <= 2):", "if (not x < 2):", "print((x))", "pass", "(x - 1.5)"):
        assert any(line in text for text in texts), line
    assert mutants.mutated(_MODULE.replace("2", "3"), found[0]) is None


def test_what_is_caught_in_two_trees_is_compared(tmp_path: Path) -> None:
    fates = {
        "before": ("caught", "caught", "survived"),
        "after": "changed survived survived",
    }
    for name, values in fates.items():
        rows = values.split() if isinstance(values, str) else values
        lines = [
            json.dumps({"file": "a.py", "function": "f", "index": i, "fate": fate})
            for i, fate in enumerate(rows)
        ]
        (tmp_path / name).write_text("\n".join(lines))
    text = mutants.comparison(tmp_path / "before", tmp_path / "after")
    assert text.startswith("2 mutants tried in both (3 and 3)")
    assert "caught before alone: a.py f 1" in text
