"""Documented, bounded settings: one line declares default, help, unit and range."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from walltopo.core.errors import SettingsError

__all__ = ["check_settings", "setting"]


def setting(
    default: Any,
    help: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
    content: tuple[str, ...] = (),
) -> Any:
    """Declare one field of a settings dataclass.

    Parameters
    ----------
    default : the value used when the user says nothing (immutable).
    help : one line that says what it does; shown by `walltopo settings` and in the docs.
    unit : unit of the value, empty for pure numbers.
    low, high : inclusive bounds.
    choices : the allowed words.
    content : for a value that may name a file or folder: what of it counts as input of the stage
        ("." the path itself, else names within the folder). A scan then notices new content.
    """
    metadata = {"help": help, "unit": unit, "low": low, "high": high, "choices": choices}
    return dataclasses.field(default=default, metadata=metadata | {"content": content})


def check_settings(settings: Any, section: str) -> None:
    """Refuse values out of range; called from `__post_init__` of each settings class.

    Raises
    ------
    SettingsError : names the key, what was expected and what came.
    """
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        low, high = field.metadata.get("low"), field.metadata.get("high")
        choices = field.metadata.get("choices", ())
        name = f"{section}.{field.name}"
        if isinstance(value, float) and not math.isfinite(value):
            raise SettingsError(f"{name}: expected a finite number, got {value}")
        if choices and value not in choices:
            raise SettingsError(f"{name}: expected one of {', '.join(choices)}, got {value!r}")
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            if low is not None and value < low:
                raise SettingsError(f"{name}: expected at least {low}, got {value}")
            if high is not None and value > high:
                raise SettingsError(f"{name}: expected at most {high}, got {value}")
