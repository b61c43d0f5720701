"""Command-line options made from declared settings."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, TypeVar

from walltopo.core import SettingField, settings_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

__all__ = ["add_option", "add_options", "option_help", "options_given"]

Section = TypeVar("Section", bound="DataclassInstance")


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
        kind = type(field.default)
        group.add_argument(name, type=kind, choices=field.choices or None, help=text)


def add_options(group: argparse._ActionsContainer, section: type[DataclassInstance]) -> None:
    """One option for each setting of a section."""
    for field in settings_of(section).values():
        add_option(group, field)


def options_given(args: argparse.Namespace, section: type[Section]) -> Section:
    """The section with what was given on the command line."""
    values = {name: getattr(args, name) for name in settings_of(section)}
    return section(**{name: value for name, value in values.items() if value is not None})
