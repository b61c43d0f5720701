"""Declared settings: a typed field, its default, and what is to be known of it.

    @dataclass(frozen=True)
    class TextureSettings:
        size: Annotated[int, about("longer side of the atlas", unit="px", low=256)] = 4096

        def __post_init__(self) -> None:
            check_settings(self, "texture")

The type and the default are checked by mypy, the bounds when the object is made.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import typing
from collections.abc import Mapping
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
    """What goes beside the type of a setting, in `Annotated[type, about(...)]`.

    Parameters
    ----------
    text : one line that says what it does; shown by `walltopo settings` and in the docs.
    unit : unit of the value, empty for pure numbers.
    low, high : inclusive bounds.
    content : for a value that may name a file or folder: what of it counts as input of the stage
        ("." the path itself, else names within the folder). A scan then notices new content.
    program : its value leads to code that is run; only the user's own word may set it.
    expert : told by `walltopo settings --all` only.
    """
    return _About(text, unit, low, high, content, program, expert)


@dataclass(frozen=True, kw_only=True)
class SettingField(_About):
    """One declared setting, with what `about` says of it.

    Parameters
    ----------
    name, default : of the field.
    type : its type, without what `about` added.
    choices : the words of a `Literal`, else empty.
    """

    name: str
    type: Any
    default: Any
    choices: tuple[str, ...]

    @property
    def type_name(self) -> str:
        """The type as people read it."""
        if self.choices:
            return "str"
        return self.type.__name__ if isinstance(self.type, type) else str(self.type)


def settings_of(section: type[DataclassInstance]) -> Mapping[str, SettingField]:
    """The declared settings of a dataclass by name, in their order."""
    return _settings_of(section)


@functools.cache
def _settings_of(section: type[DataclassInstance]) -> Mapping[str, SettingField]:
    hints = typing.get_type_hints(section, include_extras=True)
    found: dict[str, SettingField] = {}
    for field in dataclasses.fields(section):
        hint = hints[field.name]
        if typing.get_origin(hint) is not Annotated:
            raise TypeError(f"{section.__name__}.{field.name}: a setting needs `about(...)`")
        kind, told = typing.get_args(hint)[:2]
        choices = typing.get_args(kind) if typing.get_origin(kind) is Literal else ()
        default = field.default
        if default is dataclasses.MISSING and field.default_factory is not dataclasses.MISSING:
            default = field.default_factory()
        found[field.name] = SettingField(
            name=field.name,
            type=kind,
            default=default,
            choices=choices,
            **dataclasses.asdict(told),
        )
    return found


def checked_value(value: object, field: SettingField, where: str) -> Any:
    """The value in the field's own type (an int passes as a float, a list as a tuple).

    Raises
    ------
    SettingsError : a wrong type, a value that is not finite, or out of range; begins with `where`.
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


def out_of_bounds(value: int | float, low: float | None, high: float | None) -> str:
    """What is wrong with a number that has these inclusive bounds; "" where nothing is.

    Without a bound of its own a whole number must be one of 32 bits, which is what compiled code
    takes, and any other within 1e12, beyond which no length or share of ours makes sense.
    """
    if not math.isfinite(value):
        return f"expected a finite number, got {value}"
    most = 2**31 - 1 if isinstance(value, int) else 1e12
    low, high = -most if low is None else low, most if high is None else high
    if value < low:
        return f"expected at least {low}, got {value}"
    return f"expected at most {high}, got {value}" if value > high else ""


def check_settings(settings: DataclassInstance, section: str) -> None:
    """Refuse values of a wrong type or out of range; for `__post_init__` of a settings class.

    Raises
    ------
    SettingsError : names the key, what was expected and what came.
    """
    for name, field in settings_of(type(settings)).items():
        checked_value(getattr(settings, name), field, f"{section}.{name}")
