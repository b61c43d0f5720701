"""TOML files, and a limit on how deep their values are nested."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from walltopo.core.errors import InputError

_MOST_BYTES = 4 << 20  # tomllib's time grows with the square of some files' length

_DEEPEST = 32


def read_toml(path: Path, hint: str = "") -> dict[str, Any]:
    """The table of a TOML file.

    Parameters
    ----------
    hint : what to do where there is no such file.

    Raises
    ------
    InputError : the file is missing, cannot be read, is not TOML, or is larger or nested deeper
        than any that people write; names the file.
    """
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(_MOST_BYTES + 1)
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file", hint) from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    if len(content) > _MOST_BYTES:
        raise InputError(f"{path}: larger than {_MOST_BYTES >> 20} MB, not a TOML of walltopo")
    try:
        table = tomllib.loads(content.decode("utf-8"))
    except RecursionError as error:
        raise InputError(f"{path}: not valid TOML (nested too deeply)") from error
    except ValueError as error:  # TOMLDecodeError, UnicodeDecodeError, a number of 5,000 digits
        raise InputError(f"{path}: not valid TOML ({error})") from error
    if deeper_than(_DEEPEST, table):
        raise InputError(f"{path}: not valid TOML (nested too deeply)")
    return table


def deeper_than(most: int, value: Any) -> bool:
    """Whether lists and tables lie in each other more than `most` deep; without recursion."""
    level: list[Any] = [value]
    for _ in range(most + 1):
        level = [item for outer in level for item in _items(outer)]
        if not level:
            return False
    return True


def _items(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, (list, tuple)) else ()
