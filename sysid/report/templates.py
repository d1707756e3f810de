"""Fills the templates of reports."""

import math
from collections.abc import Sequence
from typing import Any

import jinja2
from plotly.offline import get_plotlyjs

from sysid.report.plots import Plot

_ENVIRONMENT = jinja2.Environment(
    loader=jinja2.PackageLoader("sysid.report", "."),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
    undefined=jinja2.StrictUndefined,
)


def _number(value: float) -> str:
    return f"{value:.5g}"


def _short(value: float) -> str:
    return f"{value:.3g}"


def _brief(value: float) -> str:
    return f"{value:.2g}"


def _times(value: float) -> str:
    return f"{value:.2f}" if value < 100.0 else f"{value:.0f}"


def interval(ends: Sequence[float]) -> str:
    """Returns an interval in as many digits as tell its ends apart, at least two."""
    low, high = ends
    largest, width = max(abs(low), abs(high)), high - low
    digits = 2
    if 0.0 < width < largest:
        digits = min(6, math.ceil(math.log10(largest / width)) + 1)
    return f"{low:.{digits}g} … {high:.{digits}g}"


def _figure(drawn: Plot) -> str:
    """Returns a figure as HTML, for a page that has Plotly's script."""
    config = {"displaylogo": False, "responsive": True}
    return str(
        drawn.figure.to_html(
            full_html=False,
            include_plotlyjs=False,
            include_mathjax=False,
            config=config,
        )
    )


_ENVIRONMENT.filters["number"] = _number
_ENVIRONMENT.filters["short"] = _short
_ENVIRONMENT.filters["brief"] = _brief
_ENVIRONMENT.filters["times"] = _times
_ENVIRONMENT.filters["interval"] = interval
_ENVIRONMENT.filters["figure"] = _figure
_ENVIRONMENT.globals["plotly_script"] = get_plotlyjs


def render(template: str, **values: Any) -> str:
    """Returns a template of this folder with values in it; all must be there."""
    return _ENVIRONMENT.get_template(template).render(**values)
