"""Options of commands: for settings, for outputs and for `--overwrite`."""

from __future__ import annotations

import argparse
import importlib.util
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from walltopo.core import InputError, SettingField, settings_of
from walltopo.core.outputs import Target
from walltopo.core.settings import checked_value, known_setting, out_of_bounds, override

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


Section = TypeVar("Section", bound="DataclassInstance")

MAX_SEED = 2**32 - 1  # the limit of all our random generators


@dataclass(frozen=True)
class Number:
    """The `type` of an argparse option: a finite number within bounds (see `out_of_bounds`).

    Any other text ends in argparse's message and exit code 2, before any work.
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
    """Return the help of one setting, escaped for argparse."""
    unit = f" [{field.unit}]" if field.unit else ""
    # argparse interprets % in help texts as a format.
    return f"{field.text}{unit} (default: {default})".replace("%", "%%")


def add_option(group: argparse._ActionsContainer, field: SettingField, default: Any = None) -> None:
    """Add `--name` for one setting; its value is None if the option is not given."""
    name = "--" + field.name.replace("_", "-")
    text = option_help(field, field.default if default is None else default)
    if isinstance(field.default, bool):
        group.add_argument(name, action=argparse.BooleanOptionalAction, default=None, help=text)
    else:
        group.add_argument(name, type=_option_type(field), choices=field.choices or None, help=text)


def _option_type(field: SettingField) -> Callable[[str], Any]:
    kind = type(field.default)
    return Number(kind, field.low, field.high) if kind in (int, float) else kind


def add_options(group: argparse._ActionsContainer, section: type[DataclassInstance]) -> None:
    """Add an option for each setting, except expert settings, which `--set` reaches."""
    fields = settings_of(section).values()
    for field in fields:
        if not field.expert:
            add_option(group, field)
    if any(field.expert for field in fields):
        group.add_argument(
            "--set",
            action="append",
            default=[],
            metavar="KEY=VALUE",
            help="any other setting, such as seed=1 (`walltopo settings --all` lists them)",
        )


def options_given(args: argparse.Namespace, section: type[Section]) -> Section:
    """Return the section with the values from the command line.

    Raises
    ------
    SettingsError : `--set` names an unknown setting, or an invalid value.
    """
    fields = settings_of(section)
    values = {name: value for name in fields if (value := getattr(args, name, None)) is not None}
    for text in getattr(args, "set", ()):
        key, value = override(text)
        values[key] = checked_value(value, known_setting(fields, key, "--set"), f"--set {key}")
    return section(**values)


class Parser(argparse.ArgumentParser):
    """An `ArgumentParser` that escapes control characters in its errors."""

    def error(self, message: str) -> NoReturn:
        from walltopo.cli.console import escape_controls

        super().error(escape_controls(message))


def add_overwrite(parser: argparse.ArgumentParser, *other_names: str) -> None:
    """Add `--overwrite`, for commands that write to a path of the user's choice."""
    parser.add_argument(
        "--overwrite",
        *other_names,
        action="store_true",
        help="replace existing files that this command did not write",
    )


def output_target(
    args: argparse.Namespace,
    path: Path,
    command: str,
    *,
    flag: str = "-o",
    inputs: Sequence[Path | None] = (),
) -> Target:
    """Return the target of an output; see `walltopo.core.outputs`.

    Parameters
    ----------
    args : arguments of a parser with `add_overwrite`.
    command : the words of the command, without those that vary between its runs.
    inputs : the command's inputs, except scan folders, which are protected anyway.
    """
    given = [path for path in inputs if path is not None]
    return Target(path, flag, command, args.overwrite, given, _refuse_scan)


def _refuse_scan(path: Path) -> None:
    from walltopo.scans.folder import owning_scan

    scan = owning_scan(path)
    if scan is not None:
        raise InputError(
            f"{path}: belongs to the scan {scan.root}",
            "Only `walltopo scan` writes there: choose another path.",
        )


# Imported module to the requirement for pip, such as "torch": "walltopo-lab[train]".
Needs = Mapping[str, str]


def add_needs(
    parser: argparse.ArgumentParser, needs: Needs | Callable[[argparse.Namespace], Needs]
) -> None:
    """Make `main` check, before the command runs, that modules are installed.

    Parameters
    ----------
    needs : the modules, or a function of the arguments if only some uses need them.
    """
    parser.set_defaults(needs=needs if callable(needs) else lambda _: needs)


def check_needs(args: argparse.Namespace) -> None:
    """Check that the modules of the command are installed, without importing them.

    Raises
    ------
    EnvironmentLacksError : modules are missing (the message says what to install).
    """
    if not hasattr(args, "needs"):
        return
    from walltopo.core import EnvironmentLacksError

    needs: Needs = args.needs(args)
    missing = [name for name in needs if importlib.util.find_spec(name) is None]
    if missing:
        wanted = " ".join(f"'{what}'" for what in dict.fromkeys(needs[name] for name in missing))
        raise EnvironmentLacksError(
            f"`walltopo {args.command}` needs {', '.join(missing)} for this, which "
            f"{'is' if len(missing) == 1 else 'are'} not installed; nothing was started",
            f"pip install {wanted}",
        )
