"""Fills the templates of reports."""

from typing import Any

import jinja2

_ENVIRONMENT = jinja2.Environment(
    loader=jinja2.PackageLoader("sysid.report", "."),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
    undefined=jinja2.StrictUndefined,
)


def _number(value: float) -> str:
    return f"{value:.5g}"


_ENVIRONMENT.filters["number"] = _number


def render(template: str, **values: Any) -> str:
    """Returns a template of this folder with values in it; all must be there."""
    return _ENVIRONMENT.get_template(template).render(**values)
