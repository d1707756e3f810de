"""All thresholds of effect selection are fields of SelectionSettings."""

import ast
import dataclasses
from pathlib import Path

import pytest

import sysid.effect_selection
from drake_disasm.effects import SensorDrift
from drake_disasm.logs import read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.settings import SelectionSettings
from sysid.models.from_logs import ModelChoice, model_of
from tests.sysid.effect_selection.blind import static_log

MODULES = [
    path
    for path in sorted(Path(sysid.effect_selection.__file__).parent.glob("*.py"))
    if path.name != "settings.py"
]
#: Numerical guards and sizes of output, which decide nothing.
ALLOWED = {
    "_BETWEEN_LOOKS",  # at the clock
    "_RIDGE",
    "_AT_BOUND",
    "_LEAST_LEFT",
    "_UNDETERMINED",
    "_NEAR",
    "_SHOWN",
    "_MOST",
    "_EQUAL",
    "_ROUNDING",
    "_CURVATURE_STEP",
    "_LEAST_SIZE",
    "_DEPENDENCES",
    "_FINE",
}
#: Numbers with a meaning of their own: none, one, a pair, all.
PLAIN = {0, 1, 2}


def _numbers(node: ast.AST) -> list[float]:
    return [
        each.value
        for each in ast.walk(node)
        if isinstance(each, ast.Constant)
        and isinstance(each.value, int | float)
        and not isinstance(each.value, bool)
    ]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_no_other_module_has_a_threshold(path):
    tree = ast.parse(path.read_text())
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and _numbers(node):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            assert {ast.unparse(target) for target in targets} <= ALLOWED
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            own = [side for side in sides if not isinstance(side, ast.Call)]
            numbers = {number for side in own for number in _numbers(side)}
            assert numbers <= PLAIN, ast.unparse(node)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_nothing_depends_on_the_kind_of_a_model(path):
    imported = {
        node.module
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom)
    }
    models = {name for name in imported if name and name.startswith("sysid.models")}
    assert models <= {
        "sysid.models.base",
        "sysid.models.effects",
        "sysid.models.measurements",
    }


def test_each_threshold_has_unit_reason_and_what_was_measured():
    fields = dataclasses.fields(SelectionSettings)
    assert len(fields) > 40
    for field in fields:
        assert set(field.metadata) == {"unit", "reason", "measured"}, field.name
        assert all(field.metadata.values()), field.name


@pytest.mark.parametrize(("alpha", "ending"), [(0.05, "explained"), (1e-4, "none")])
def test_thresholds_are_passed_down(alpha, ending, tmp_path):
    """With 4000 draws no p-value is as low as 1e-4."""
    log = read_log(static_log(tmp_path, [SensorDrift], 5.0, seed=2).folder)
    model = model_of([log], ModelChoice())
    settings = SelectionSettings(alpha=alpha)
    found = close_loop(model, settings=settings, library=[SensorDrift])
    assert found.verdict.ending == ending
