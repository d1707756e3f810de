"""Mutants are small, stay where their function is, and are counted."""

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
