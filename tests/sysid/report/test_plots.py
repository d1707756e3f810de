"""Figures of what was measured and predicted."""

import dataclasses

import numpy as np
import pytest

from sysid.models import Channel
from sysid.report import plots
from sysid.report.thinning import even_rows, extreme_rows
from sysid.residuals.held_out import HeldOut


def _errors(rows, channels=3, episodes=1, period=0.005):
    random = np.random.default_rng(0)
    measured = random.standard_normal((rows, channels))
    return HeldOut(
        measured,
        measured + random.standard_normal((rows, channels)),
        measured + 0.1 * random.standard_normal((rows, channels)),
        np.arange(rows) * episodes // rows,
        tuple(Channel(f"f{i}", "N", 0.1) for i in range(channels)),
        "",
        50,
        tuple(f"episode_{i}" for i in range(episodes)),
        period,
    )


def test_thinned_rows_keep_every_peak():
    values = np.random.default_rng(0).standard_normal((10_000, 2))
    values[4321, 0], values[8765, 1] = 50.0, -50.0
    rows = extreme_rows(values, 400)
    assert len(rows) <= 400 and {4321, 8765} <= set(rows)
    assert list(extreme_rows(values[:300], 400)) == list(range(300))
    assert list(even_rows(10, 3)) == [0, 4, 9]


def test_a_channel_is_shown_at_a_time_and_each_has_its_titles():
    drawn = plots.fit_plot(_errors(100), costly=[(7, 1)])
    shown = [trace for trace in drawn.figure.data if trace.visible]
    assert {trace.meta for trace in shown} == {0} and drawn.by_channel
    assert {trace.meta for trace in drawn.figure.data} == {0, 1, 2}
    names = {trace.name for trace in shown}
    assert {"measured", "predicted before", "predicted after", "noise"} <= names
    views = drawn.figure.layout.meta["titles"]
    assert [view["yaxis.title.text"] for view in views] == [f"f{i} [N]" for i in "012"]
    assert drawn.figure.layout.yaxis.title.text == "f0 [N]"
    assert drawn.caption == "All 100 rows."


def test_lines_end_with_an_episode():
    errors = _errors(90, channels=1, episodes=3)
    drawn = plots.fit_plot(errors)
    lines = [t for t in drawn.figure.data if (t.name or "").startswith("predicted")]
    assert len(lines) == 2
    for line, values in zip(lines, (errors.before, errors.after), strict=True):
        assert np.flatnonzero(np.isnan(line.y)).tolist() == [30, 61]
        shown = line.y[~np.isnan(line.y)]
        np.testing.assert_allclose(shown, values[:, 0], rtol=1e-6)
        assert not line.connectgaps


def test_a_costly_reading_is_marked_in_its_channel():
    errors = _errors(100)
    drawn = plots.fit_plot(errors, costly=[(7, 1)])
    marks = [t for t in drawn.figure.data if t.name == "costs most" and len(t.x)]
    (mark,) = marks
    assert mark.meta == 1 and mark.x[0] == pytest.approx(7 * 0.005)
    assert mark.y[0] == pytest.approx((errors.after - errors.measured)[7, 1], rel=1e-5)
    assert mark.hovertext[0] == "episode_0, 0.035 s"


def test_what_was_far_off_before_does_not_hide_the_rest():
    errors = _errors(100)
    assert plots.fit_plot(errors).figure.layout.yaxis.autorange
    far = dataclasses.replace(errors, before=1000.0 * errors.before)
    axis = plots.fit_plot(far).figure.layout.yaxis
    assert not axis.autorange and axis.range[1] < 10.0


def test_long_logs_are_thinned_and_that_is_said():
    rows, channels = 30_000, 12
    drawn = plots.fit_plot(_errors(rows, channels, episodes=3))
    most = max(len(trace.x) for trace in drawn.figure.data)
    assert most <= 4000 and f"of {rows} rows" in drawn.caption
    assert len(drawn.figure.to_json()) < 4e6


def test_residuals_against_covariates_show_their_mean():
    x = np.linspace(-1.0, 1.0, 500)
    channels = [Channel("fx", "N", 0.1), Channel("fy", "N", 0.1)]
    residual = np.column_stack([3.0 * x, 0.0 * x])
    drawn = plots.dependence_plot(
        [residual, 0.0 * residual], [{"time": x, "load": x**2}, {"time": x}], channels
    )
    assert drawn is not None and "All" not in drawn.caption
    means = [t for t in drawn.figure.data if t.name == "mean before" and t.meta == 0]
    assert len(means) == 2
    assert means[0].y == pytest.approx(3.0 * means[0].x, abs=1e-4)
    assert plots.dependence_plot([residual] * 2, [{}, {}], channels) is None


def test_what_the_model_states_of_its_own_error_is_part_of_the_unit():
    errors = _errors(1000)
    own = np.zeros_like(errors.measured)
    own[:, 1] = np.linspace(0.0, 1.0, 1000)
    stated = dataclasses.replace(errors, model_error=own)
    drawn = plots.error_plot(stated)
    before = drawn.figure.data[0]
    assert before.y == pytest.approx(stated.in_sigma(errors.before))
    assert before.y[1] < 0.5 * before.y[0] and "own error" in drawn.caption
    reach = before.y + before.error_y.array
    ends = stated.interval(errors.before, stated.sigma)[:, 1]
    assert reach == pytest.approx(ends)
    bands = [t for t in plots.fit_plot(stated).figure.data if t.name == "noise"]
    assert [np.max(band.y) for band in bands] == pytest.approx(
        [0.1, np.hypot(0.1, 1.0), 0.1]
    )
