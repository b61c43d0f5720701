"""Jinja2 as the pages use it: values are escaped, and a name that is missing is an error."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["number", "render"]


def number(value: float | None, digits: int = 1, unit: str = "") -> str:
    """A figure with its unit, whole numbers in full; an en dash where there is none."""
    if value is None or value != value:
        return "–"
    shown = f"{value:,.{digits}f}" if isinstance(value, float) else f"{value:,}"
    return f"{shown} {unit}".rstrip()


@cache
def _environment(folder: str) -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("walltopo.export", folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["number"] = number
    return environment


def render(folder: str, template: str, **values: Any) -> str:
    """The text of a template of this package.

    Parameters
    ----------
    folder : where it lies, relative to `walltopo/export`.
    values : what it may name.
    """
    return _environment(folder).get_template(template).render(**values)
