"""Declare settings: a typed field with default, help text, unit and bounds.

    @dataclass(frozen=True)
    class TextureSettings:
        size: Annotated[int, about("longer side of the atlas", unit="px", low=256)] = 4096

        def __post_init__(self) -> None:
            check_settings(self, "texture")

mypy checks the type and the default; `check_settings` checks the bounds when an object is created.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import tomllib
import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec

from walltopo.core.errors import SettingsError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True)
class _About:
    text: str
    unit: str
    low: float | None
    high: float | None
    content: tuple[str, ...]
    program: bool
    expert: bool


def about(
    text: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    content: tuple[str, ...] = (),
    program: bool = False,
    expert: bool = False,
) -> object:
    """Return the annotation of a setting, for `Annotated[type, about(...)]`.

    Parameters
    ----------
    text : one line that says what it does; shown by `walltopo settings` and in the docs.
    unit : unit of the value, empty for pure numbers.
    low, high : inclusive bounds.
    content : for a value that may name a file or folder: the parts whose content is an input of the
        stage ("." the path itself, else names within the folder).
    program : whether the value names code to run; such a setting must come from the user directly.
    expert : whether only `walltopo settings --all` lists the setting.
    """
    return _About(text, unit, low, high, content, program, expert)


@dataclass(frozen=True, kw_only=True)
class SettingField(_About):
    """One declared setting, with the information of `about`.

    Parameters
    ----------
    name, default : name and default of the field.
    type : type of the field, without the annotation.
    choices : values of a `Literal`, else empty.
    """

    name: str
    type: Any
    default: Any
    choices: tuple[str, ...]

    @property
    def type_name(self) -> str:
        """Return the type in words."""
        if self.choices:
            return "str"
        return self.type.__name__ if isinstance(self.type, type) else str(self.type)


def settings_of(section: type[DataclassInstance]) -> Mapping[str, SettingField]:
    """Return the declared settings of a dataclass by name, in order."""
    return _settings_of(section)


@functools.cache
def _settings_of(section: type[DataclassInstance]) -> Mapping[str, SettingField]:
    hints = typing.get_type_hints(section, include_extras=True)
    found: dict[str, SettingField] = {}
    for field in dataclasses.fields(section):
        hint = hints[field.name]
        if typing.get_origin(hint) is not Annotated:
            raise TypeError(f"{section.__name__}.{field.name}: a setting needs `about(...)`")
        kind, notes = typing.get_args(hint)[:2]
        choices = typing.get_args(kind) if typing.get_origin(kind) is Literal else ()
        default = field.default
        if default is dataclasses.MISSING and field.default_factory is not dataclasses.MISSING:
            default = field.default_factory()
        found[field.name] = SettingField(
            name=field.name,
            type=kind,
            default=default,
            choices=choices,
            **dataclasses.asdict(notes),
        )
    return found


def checked_value(value: object, field: SettingField, where: str) -> Any:
    """Convert and check a value (an int passes as a float, a list as a tuple).

    Raises
    ------
    SettingsError : a wrong type, or a value that is not finite or out of range; the message begins
        with `where`.
    """
    try:
        found = msgspec.convert(value, field.type)
    except msgspec.ValidationError as error:
        wanted = f"one of {', '.join(field.choices)}" if field.choices else field.type_name
        raise SettingsError(f"{where}: expected {wanted}, got {value!r}") from error
    if isinstance(found, (int, float)) and not isinstance(found, bool):
        wrong = out_of_bounds(found, field.low, field.high)
        if wrong:
            raise SettingsError(f"{where}: {wrong}")
    return found


def override(text: str) -> tuple[str, Any]:
    """Return key and value of a command line argument KEY=VALUE; the value is TOML, else a string.

    Raises
    ------
    SettingsError : the equals sign is missing.
    """
    key, equals, raw = (part.strip() for part in text.partition("="))
    if not equals:
        raise SettingsError(f"--set {text}: expected KEY=VALUE")
    try:
        return key, tomllib.loads(f"v = {raw}")["v"]
    except (ValueError, RecursionError):  # not TOML, or thousands of digits or brackets
        return key, raw


def known_setting(known: Mapping[str, SettingField], key: str, origin: str) -> SettingField:
    """Return the setting of a name.

    Raises
    ------
    SettingsError : unknown setting; the message suggests the nearest one and begins with `origin`.
    """
    if key not in known:
        raise unknown_setting(key, known, origin, "`walltopo settings` lists all.")
    return known[key]


def unknown_setting(key: str, known: Iterable[str], origin: str, listing: str) -> SettingsError:
    """Return the error for an unknown setting, whose hint suggests the nearest known one.

    Parameters
    ----------
    origin : where the setting was given, the beginning of the message.
    listing : sentence that names the list of all settings.
    """
    near = difflib.get_close_matches(key, list(known), n=1, cutoff=0.5)
    meant = f"Did you mean {near[0]}? " if near else ""
    return SettingsError(f"{origin}: unknown setting {key!r}", meant + listing)


def out_of_bounds(value: int | float, low: float | None, high: float | None) -> str:
    """Return why a number is outside of its inclusive bounds; "" if it is inside.

    Without explicit bounds, an integer must fit 32 bits, because compiled code takes such integers,
    and a float must be within 1e12.
    """
    if not math.isfinite(value):
        return f"expected a finite number, got {value}"
    limit = 2**31 - 1 if isinstance(value, int) else 1e12
    low, high = -limit if low is None else low, limit if high is None else high
    if value < low:
        return f"expected at least {low}, got {value}"
    return f"expected at most {high}, got {value}" if value > high else ""


def check_settings(settings: DataclassInstance, section: str) -> None:
    """Raise SettingsError for invalid values; for `__post_init__` of a settings class.

    Raises
    ------
    SettingsError : the message has the key, the expected and the actual value.
    """
    for name, field in settings_of(type(settings)).items():
        checked_value(getattr(settings, name), field, f"{section}.{name}")
