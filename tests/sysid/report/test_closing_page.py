"""The report of a closed loop, as a page."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import SensorDrift
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.report import closing_page
from sysid.report.templates import interval
from tests.sysid.effect_selection.blind import closed, static_log
from tests.sysid.report.pages import own_part


@pytest.fixture(scope="module")
def found(tmp_path_factory) -> ClosedLoop:
    folder = tmp_path_factory.mktemp("drifting")
    return closed(static_log(folder, [SensorDrift], 5.0, seed=2))


def test_the_page_needs_nothing_else_and_begins_with_the_sentence(found):
    page = own_part(closing_page(found, {"command": "as told"}))
    body = page[page.index("<body>") :]
    sentence = found.sentence.replace("'", "&#39;")
    assert body.index(sentence) < body.index("<h2>")
    assert "SensorDrift" in page and "F_read = F + d min(t, T)" in page
    assert SensorDrift.description() in page and "along" in page
    assert "as told" in page and page.count("<h2>") >= 7
    assert page.count('class="plotly-graph-div"') == 5


def test_a_channel_that_gets_worse_is_marked(found):
    errors = found.errors
    assert "(worse)" not in closing_page(found, {})
    after = errors.after.copy()
    after[:, 1] = errors.measured[:, 1] + 100.0
    harmed = dataclasses.replace(found, errors=dataclasses.replace(errors, after=after))
    page = closing_page(harmed, {})
    assert "fy (worse)" in page and "fx (worse)" not in page
    assert "Worse with the effects than without: fy." in page


def test_an_error_that_the_model_states_of_itself_has_a_column(found):
    own = "model's own error"
    assert own not in own_part(closing_page(found, {}))
    errors = dataclasses.replace(
        found.errors, model_error=np.full_like(found.errors.measured, 0.1234375)
    )
    page = own_part(closing_page(dataclasses.replace(found, errors=errors), {}))
    assert f"<th>{own}</th>" in page and page.count("<td>0.123</td>") == 6


def test_what_is_at_its_bound_and_what_is_not_explained_is_marked(found):
    verdict = dataclasses.replace(found.verdict, ending="explained")
    found = dataclasses.replace(found, verdict=verdict)
    page = own_part(closing_page(found, {}))
    assert "at its bound" not in page and 'class="box warn"' not in page
    values = tuple(dataclasses.replace(v, is_at_bound=True) for v in verdict.values)
    other = dataclasses.replace(verdict, values=values, ending="partly")
    page = closing_page(dataclasses.replace(found, verdict=other), {})
    assert "at its bound" in page and 'class="box warn"' in page


def test_an_interval_has_the_digits_that_tell_its_ends_apart():
    assert interval((5.978, 5.998)) == "5.978 … 5.998"
    assert interval((-0.1234, 0.3456)) == "-0.12 … 0.35"
    assert interval((1e6, 1e6 + 1e-9)) == "1e+06 … 1e+06"
