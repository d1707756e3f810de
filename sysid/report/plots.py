"""Interactive figures of what was measured and predicted, as pure functions.

Where a figure shows one channel at a time, its series carry the channel's number as
`meta`, and the layout the titles of each channel: the page's channel picker
(`plots.html.j2`) shows those of the channel that was picked.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from sysid.effect_selection.changes import Course
from sysid.effect_selection.forward_selection import Gain
from sysid.models.measurements import Channel
from sysid.report.loss_map import LossMap, place
from sysid.report.thinning import even_rows, extreme_rows
from sysid.residuals.held_out import HeldOut

Array = NDArray[np.float64]

_BEFORE, AFTER, MEASURED = "#9aa4ae", "#c03030", "#202020"
PASSES, _FAILS, _MARK = "#2060a0", "#c8d0d8", "#d98c00"
_ENDS = (("before", _BEFORE), ("after", AFTER))
_SHOWN_VALUES = 48_000  # of a series over all channels: what keeps a page small
_SHOWN_POINTS = 60_000  # of residuals against covariates, over all panels
_FAR_OFF = 5.0  # times what was measured, beyond which a prediction is not shown whole
_SHOWN_DOTS = 500  # beyond which what was measured is a line
_COLUMNS = 3
_BINS = 25  # of a covariate, over which a residual is averaged
_SHOWN_EPISODES = 60
_CANDIDATES = 15


@dataclass(frozen=True)
class Plot:
    """A figure with its caption.

    Attributes:
        figure: Plotly's.
        caption: what is drawn, and what is left out.
        by_channel: whether it shows one channel at a time.
    """

    figure: go.Figure
    caption: str = ""
    by_channel: bool = False


def fit_plot(errors: HeldOut, costly: Sequence[tuple[int, int]] = ()) -> Plot:
    """Returns measured and predicted channels over time, and below them the errors.

    Args:
        errors: measured and predicted rows.
        costly: row and channel of readings that are marked.
    """
    figure = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06)
    time, axis = _time(errors)
    marked = np.array(costly, dtype=np.int64).reshape(-1, 2)
    count = 0
    for number in range(len(errors.channels)):
        own = [
            np.asarray(predicted[:, number] - errors.measured[:, number])
            for predicted in (errors.before, errors.after)
        ]
        most = _SHOWN_VALUES // len(errors.channels)
        rows = extreme_rows(np.column_stack(own), most)
        count = max(count, len(rows))
        series = _channel_series(errors, number, time, rows, own)
        at = marked[marked[:, 1] == number, 0]
        series.append((2, _marks(time[at], own[1][at], [place(errors, r) for r in at])))
        series.append((2, _noise_band(errors, number, time, rows)))
        for line, trace in series:
            trace.update(meta=number, visible=number == 0)
            figure.add_trace(trace, row=line, col=1)
    for begin in _episode_begins(errors, time):
        figure.add_vline(x=begin, line={"color": "#d0d0d0", "width": 1})
    figure.update_xaxes(title_text=axis, row=2, col=1)
    titles = [_channel_view(errors, number) for number in range(len(errors.channels))]
    finish(figure, 620, titles)
    figure.update_layout(hovermode="x")
    return Plot(figure, _thinned_text(count, len(time)), by_channel=True)


def error_plot(errors: HeldOut) -> Plot:
    """Returns each channel's rms error before and after, in units of `sigma`."""
    names = [channel.name for channel in errors.channels]
    figure = go.Figure()
    for (label, colour), predicted in zip(
        _ENDS, (errors.before, errors.after), strict=True
    ):
        size = errors.in_sigma(predicted)
        ends = errors.interval(predicted, errors.sigma).T
        spread = {"array": ends[1] - size, "arrayminus": size - ends[0]}
        bars = go.Bar(x=names, y=size, error_y=spread, name=label, marker_color=colour)
        figure.add_trace(bars)
    figure.add_hline(y=1.0, line={"color": MEASURED, "dash": "dash", "width": 1})
    figure.update_yaxes(title_text="rms error / noise", rangemode="tozero")
    finish(figure, 320)
    caption = "Over the rows above; the whiskers are 95 % intervals."
    if errors.model_error is not None:
        caption += " The unit is the noise of each row with the model's own error."
    return Plot(figure, caption)


def loss_plot(found: LossMap, channels: Sequence[Channel]) -> Plot:
    """Returns where the loss is: channels against episodes, or stretches of one."""
    names = [channel.name for channel in channels]
    top = float(np.quantile(found.before, 0.95))
    figure = make_subplots(
        2, 1, shared_xaxes=True, subplot_titles=("before", "after"),
        vertical_spacing=0.12,
    )  # fmt: skip
    for line, values in ((1, found.before), (2, found.after)):
        heat = go.Heatmap(
            x=list(found.labels), y=names, z=values, zmin=0.0, zmax=top,
            colorscale="YlOrRd", showscale=line == 1,
            colorbar={"title": "rms / noise"},
            hovertemplate="%{y}, %{x}: %{z:.2f}<extra></extra>",
        )  # fmt: skip
        figure.add_trace(heat, row=line, col=1)
    figure.update_yaxes(autorange="reversed")
    figure.update_xaxes(type="category", nticks=20)
    finish(figure, 160 + 36 * max(4, len(names)))
    return Plot(figure)


def dependence_plot(
    residuals: Sequence[Array], covariates: Sequence[Mapping[str, Array]],
    channels: Sequence[Channel],
) -> Plot | None:  # fmt: skip
    """Returns residuals against what they may depend on; None if that is nothing.

    Args:
        residuals: before and after, (rows, channels) in units of the noise.
        covariates: of each channel, (rows,) each, by name.
        channels: what the columns are.
    """
    names = list(dict.fromkeys(name for own in covariates for name in own))
    if not names:
        return None
    lines = -(-len(names) // _COLUMNS)
    figure = make_subplots(lines, min(_COLUMNS, len(names)), shared_yaxes=True)
    most = _SHOWN_POINTS // (2 * len(channels) * len(names))
    rows = even_rows(len(residuals[0]), most)
    for number, own in enumerate(covariates):
        for name, values in own.items():
            spot = divmod(names.index(name), _COLUMNS)
            traces = _against(values, [r[:, number] for r in residuals], rows)
            for trace in traces:
                trace.update(
                    meta=number, visible=number == 0, showlegend=spot == (0, 0)
                )
                figure.add_trace(trace, row=spot[0] + 1, col=spot[1] + 1)
    for number, name in enumerate(names):
        line, column = divmod(number, _COLUMNS)
        figure.update_xaxes(title_text=name, row=line + 1, col=column + 1)
    titles = [{"yaxis.title.text": f"error of {c.name} / noise"} for c in channels]
    finish(figure, 60 + 260 * lines, titles)
    return Plot(
        figure,
        "Points: residuals of fitted rows"
        + (f" ({len(rows)} of {len(residuals[0])})" * (len(rows) < len(residuals[0])))
        + f"; lines: means of all of them over {_BINS} ranges with equally many rows.",
        by_channel=True,
    )


def candidate_plot(begin: Sequence[Gain], end: Sequence[Gain], least: float) -> Plot:
    """Returns what each candidate would explain, without and with the effects.

    Args:
        begin, end: the best first.
        least: gain from which on an effect is selected.
    """
    titles = ("without added effects", "with added effects")
    figure = make_subplots(1, 2, subplot_titles=titles, horizontal_spacing=0.3)
    for column, gains in ((1, begin), (2, end)):
        best = _best_shapes(gains)[:_CANDIDATES][::-1]
        bars = go.Bar(
            y=[gain.text for gain in best],
            x=[max(100.0 * gain.share, 0.0) for gain in best],
            orientation="h", showlegend=False,
            marker_color=[PASSES if g.share >= least else _FAILS for g in best],
            hovertext=[
                f"{100.0 * float(np.mean(g.of_blocks > 0.0)):.0f} % of the folds better"
                for g in best
            ],
        )  # fmt: skip
        figure.add_trace(bars, row=1, col=column)
    figure.update_xaxes(title_text="share of the held-out loss explained, %")
    figure.update_yaxes(tickfont={"size": 10}, automargin=True)
    finish(figure, 460)
    return Plot(figure)


def course_plot(courses: Sequence[Course]) -> Plot:
    """Returns how large each change is in each log, with 95 % intervals."""
    sized = [[v for v in course.values if v.null is not None] for course in courses]
    titles = [f"{value.name} [{value.unit}]" for value in sized[0]]
    figure = make_subplots(len(titles), 1, shared_xaxes=True, subplot_titles=titles)
    logs = [course.episode for course in courses]
    for line, values in enumerate(zip(*sized, strict=True), start=1):
        middle = np.array([value.value for value in values])
        low, high = np.array([value.interval for value in values]).T
        bars = {"array": high - middle, "arrayminus": middle - low}
        trace = go.Scatter(
            x=logs, y=middle, error_y=bars, mode="markers+lines", showlegend=False
        )
        figure.add_trace(trace, row=line, col=1)
        figure.add_hline(0.0, row=line, col=1, line={"color": "#d0d0d0", "width": 1})
    finish(figure, 160 * len(titles) + 80)
    return Plot(figure, "Fitted to the references and each log by itself; bars: 95 %.")


def _channel_view(errors: HeldOut, number: int) -> dict[str, Any]:
    """Returns the titles of a channel's two panels, and the range of the upper one.

    What was predicted before may be so far off that nothing else could be seen: then
    that shows what was measured and what is predicted now.
    """
    channel = errors.channels[number]
    before, after, measured = (
        values[:, number] for values in (errors.before, errors.after, errors.measured)
    )
    main = np.append(measured, after)
    low, high = float(main.min()), float(main.max())
    is_far = np.ptp(before) > _FAR_OFF * (high - low)
    view: dict[str, Any] = {
        "yaxis.title.text": f"{channel.name} [{channel.unit}]",
        "yaxis2.title.text": f"error of {channel.name} [{channel.unit}]",
        "yaxis.autorange": not is_far,
    }
    if is_far:
        margin = 0.08 * (high - low)
        view["yaxis.range"] = [low - margin, high + margin]
    return view


def _channel_series(
    errors: HeldOut, number: int, time: Array, rows: NDArray[np.int64],
    own: Sequence[Array],
) -> list[tuple[int, go.Scatter]]:  # fmt: skip
    """Returns a channel's series with the number of the panel of each.

    Lines end with an episode: a reading that is none stands between two.
    """
    ends = np.flatnonzero(np.diff(errors.episode[rows])) + 1

    def shown(values: Array) -> NDArray[np.float32]:
        """Returns what is drawn of values (rows,)."""
        return _small(np.insert(values[rows], ends, np.nan))

    x, found = shown(time), []
    for (label, colour), predicted, error in zip(
        _ENDS, (errors.before, errors.after), own, strict=True
    ):
        name = f"predicted {label}"
        line = {"color": colour, "width": 1.2}
        for panel, y in ((1, predicted[:, number]), (2, error)):
            text = name if panel == 1 else f"error {label}"
            trace = go.Scatter(
                x=x, y=shown(y), name=text, mode="lines", line=line,
                legendgroup=label, showlegend=panel == 1,
            )  # fmt: skip
            found.append((panel, trace))
    dots = go.Scatter(
        x=x, y=shown(errors.measured[:, number]), name="measured",
        mode="markers" if len(rows) <= _SHOWN_DOTS else "lines",
        marker={"color": MEASURED, "size": 4}, line={"color": MEASURED, "width": 2},
    )  # fmt: skip
    return [(1, dots), *found]


def _marks(x: Array, y: Array, where: Sequence[str]) -> go.Scatter:
    """Returns marks at the readings that cost most."""
    circle = {"color": _MARK, "size": 9, "symbol": "circle-open", "line": {"width": 2}}
    return go.Scatter(
        x=_small(x), y=_small(y), mode="markers", name="costs most", hovertext=where,
        marker=circle,
    )  # fmt: skip


def _noise_band(
    errors: HeldOut, number: int, time: Array, rows: NDArray[np.int64]
) -> go.Scatter:
    """Returns a grey band of one standard deviation of a channel about zero."""
    if errors.model_error is None:
        x, high = time[[0, -1]], np.full(2, errors.channels[number].noise)
    else:
        x, high = time[rows], errors.sigma[rows, number]
    return go.Scatter(
        x=_small(np.append(x, x[::-1])), y=_small(np.append(high, -high[::-1])),
        fill="toself", mode="none", fillcolor="rgba(32, 32, 32, 0.10)", name="noise",
        hoverinfo="skip",
    )  # fmt: skip


def _against(
    values: Array, residuals: Sequence[Array], rows: NDArray[np.int64]
) -> list[go.Scatter]:
    """Returns points and means of residuals (rows,) against a covariate (rows,)."""
    order = np.argsort(values, kind="stable")
    bins = [part for part in np.array_split(order, _BINS) if len(part)]
    middle = [values[part].mean() for part in bins]
    points, means = [], []
    for (label, colour), residual in zip(_ENDS, residuals, strict=True):
        dots = {"color": colour, "size": 2.5, "opacity": 0.4}
        cloud = go.Scatter(
            x=_small(values[rows]), y=_small(residual[rows]), mode="markers",
            marker=dots, name=label, legendgroup=label, hoverinfo="skip",
        )  # fmt: skip
        points.append(cloud)
        mean, line = [residual[part].mean() for part in bins], {"color": colour}
        curve = go.Scatter(
            x=_small(middle), y=_small(mean), mode="lines", line=line | {"width": 3},
            name=f"mean {label}", legendgroup=label,
        )  # fmt: skip
        means.append(curve)
    return [*points, *means]


def _best_shapes(gains: Sequence[Gain]) -> list[Gain]:
    """Returns each effect once, with the shape parameters that explain most."""
    found: dict[tuple[str, ...], Gain] = {}
    for each in gains:
        found.setdefault(each.term.names, each)
    return list(found.values())


def _time(errors: HeldOut) -> tuple[Array, str]:
    """Returns where rows are drawn (rows,), and what that axis is."""
    rows = np.arange(len(errors.episode), dtype=float)
    if errors.period and int(errors.episode.max()) == 0:
        return rows * errors.period, "time [s]"
    return rows, "row"


def _episode_begins(errors: HeldOut, time: Array) -> list[float]:
    """Returns where episodes begin, if there are not too many."""
    begins = np.flatnonzero(np.diff(errors.episode)) + 1
    return time[begins].tolist() if len(begins) < _SHOWN_EPISODES else []


def _thinned_text(shown: int, rows: int) -> str:
    if shown == rows:
        return f"All {rows} rows."
    return (
        f"At most {shown} of {rows} rows a channel: of each stretch those "
        "with the least and the greatest error, so that no peak is lost."
    )


def _small(values: Any) -> NDArray[np.float32]:
    """Returns values in single precision, which is enough for a figure."""
    return np.asarray(values, dtype=np.float32)


def finish(
    figure: go.Figure, height: int, titles: Sequence[Mapping[str, Any]] = ()
) -> None:
    """Sets what all figures have in common, and the axes' views of each channel."""
    figure.update_layout(
        template="plotly_white", height=height,
        margin={"l": 60, "r": 20, "t": 40, "b": 45},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        font={"size": 12}, meta={"titles": list(titles)},
    )  # fmt: skip
    for path, value in titles[0].items() if titles else ():
        axis, _, field = path.partition(".")
        figure.layout[axis][field] = value
