"""The report on which policies the corrected twin accepts."""

from pathlib import Path

import numpy as np

from sysid.acceptance import CorrectedTwin, accept
from sysid.report.acceptance import acceptance_page, strip_plot
from tests.sysid.report.pages import own_part
from tests.tools.inputs import write_closed


def test_each_trial_is_a_dot_and_reservations_are_at_the_top(tmp_path: Path) -> None:
    folder = write_closed(tmp_path, left_in_channels=[{"channel": "tz"}])
    twin = CorrectedTwin.read(folder)
    judged = accept(["straight"], twin, draws=6)
    figure = strip_plot(judged, 20.0).figure
    dots = {trace.name: list(trace.x) for trace in figure.data}
    forces = [t.peak_force for t in judged[0].draws]
    assert np.allclose(sorted(dots["success"] + dots["failure"]), sorted(forces))
    assert len(dots["failure"]) == 6 - judged[0].successes > 0
    assert dots["success at the verdict's values"] == [judged[0].values.peak_force]
    page = own_part(acceptance_page(judged, twin, {"command": "drake-disasm accept"}))
    top = page[: page.index("<h2>")]
    assert "refused" in top and "tz" in top
    assert "step limit" in page and "CommandGain.x" in page
