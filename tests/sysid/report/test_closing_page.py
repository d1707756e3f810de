"""The report of a closed loop, as a page."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import SensorDrift, SensorGain, SensorMounting
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.report import closing_page
from tests.sysid.effect_selection.blind import closed, static_log
from tests.sysid.report.pages import own_part


@pytest.fixture(scope="module")
def found(tmp_path_factory) -> ClosedLoop:
    folder = tmp_path_factory.mktemp("drifting")
    log = static_log(folder, [SensorDrift], 5.0, seed=2)
    return closed(log, [SensorDrift, SensorGain, SensorMounting])


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
