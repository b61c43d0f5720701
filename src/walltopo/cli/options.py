"""Command-line options made from declared settings."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from walltopo.core import SettingField, settings_of
from walltopo.core.settings import out_of_bounds

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


Section = TypeVar("Section", bound="DataclassInstance")

MOST_SEED = 2**32 - 1  # what every generator that we use takes


@dataclass(frozen=True)
class Number:
    """The `type` of an argparse option: a finite number within bounds (see `out_of_bounds`).

    Whatever else is given ends in argparse's message and exit code 2, before any work.
    """

    kind: type[int] | type[float]
    low: float | None = None
    high: float | None = None

    def __call__(self, text: str) -> int | float:
        wanted = "a whole number" if self.kind is int else "a number"
        try:
            value = self.kind(text)
        except ValueError:
            shown = text if len(text) <= 40 else f"{text[:40]}..."
            raise argparse.ArgumentTypeError(f"expected {wanted}, got {shown!r}") from None
        wrong = out_of_bounds(value, self.low, self.high)
        if wrong:
            raise argparse.ArgumentTypeError(wrong)
        return value


def option_help(field: SettingField, default: object) -> str:
    """The line of help of one setting, as argparse wants it."""
    unit = f" [{field.unit}]" if field.unit else ""
    # argparse formats help with %: a percent sign would be a format.
    return f"{field.text}{unit} (default: {default})".replace("%", "%%")


def add_option(group: argparse._ActionsContainer, field: SettingField, default: Any = None) -> None:
    """`--name` for one setting; its value is None where it is not given."""
    name = "--" + field.name.replace("_", "-")
    text = option_help(field, field.default if default is None else default)
    if isinstance(field.default, bool):
        group.add_argument(name, action=argparse.BooleanOptionalAction, default=None, help=text)
    else:
        group.add_argument(name, type=_kind(field), choices=field.choices or None, help=text)


def _kind(field: SettingField) -> Callable[[str], Any]:
    kind = type(field.default)
    return Number(kind, field.low, field.high) if kind in (int, float) else kind


def add_options(group: argparse._ActionsContainer, section: type[DataclassInstance]) -> None:
    """One option for each setting of a section."""
    for field in settings_of(section).values():
        add_option(group, field)


def options_given(args: argparse.Namespace, section: type[Section]) -> Section:
    """The section with what was given on the command line."""
    values = {name: getattr(args, name) for name in settings_of(section)}
    return section(**{name: value for name, value in values.items() if value is not None})
