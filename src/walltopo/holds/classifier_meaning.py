"""What a classifier's class says of a hold: type, colour, role.

A gym names its classes as it likes. Their meaning is given in a `classes.toml`::

    [[class]]
    name = "red jug"          # as the network calls it
    type = "jug"              # default: the name
    colour = "red"            # default: left to the palette
    role = "hold"             # hold, volume (of every route), downclimb (of none)

Classes that are not listed mean a type of that name; classes called volume or downclimb have
that role.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from walltopo.core import InputError

__all__ = ["ROLES", "Meaning", "meanings_from_json", "meanings_of", "read_classes", "to_json"]

ROLES = ("hold", "volume", "downclimb")
KEYS = ("type", "colour", "role")


@dataclass(frozen=True)
class Meaning:
    """What a class says; "" where it says nothing.

    Parameters
    ----------
    type : of the hold.
    colour : "" where the class does not tell.
    role : one of `ROLES`.
    """

    type: str
    colour: str = ""
    role: str = "hold"

    def __post_init__(self) -> None:
        if self.role not in ROLES:
            raise InputError(f"role must be one of {', '.join(ROLES)}, got {self.role!r}")


def _default(name: str) -> Meaning:
    return Meaning(name, role=name if name in ROLES else "hold")


def _meaning(name: str, row: Mapping[str, Any], where: str) -> Meaning:
    unknown = sorted(set(row) - {"name", *KEYS})
    if unknown:
        raise InputError(f"{where}: class {name!r}: unknown keys {unknown}")
    if not all(isinstance(value, str) for value in row.values()):
        raise InputError(f"{where}: class {name!r}: all values must be text")
    given = {key: row[key] for key in KEYS if key in row}
    try:
        return Meaning(**{"type": name, "role": _default(name).role, **given})
    except InputError as error:
        raise InputError(f"{where}: class {name!r}: {error.message}") from error


def read_classes(path: Path) -> dict[str, Meaning]:
    """Read a `classes.toml`.

    Raises
    ------
    InputError : the file is missing, is not TOML, or an entry is wrong; names which.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file", "See docs/colours.md for its format.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML ({error})") from error
    found: dict[str, Meaning] = {}
    for number, row in enumerate(data.get("class", []), start=1):
        name = row.get("name")
        if not isinstance(name, str) or not name:
            raise InputError(f"{path}: class {number} has no name")
        if name in found:
            raise InputError(f"{path}: class {name!r} is there twice")
        found[name] = _meaning(name, row, str(path))
    if not found:
        raise InputError(f"{path}: holds no [[class]] table", "See docs/colours.md.")
    return found


def meanings_of(names: Sequence[str], given: Mapping[str, Meaning]) -> list[Meaning]:
    """The meaning of each class of a network; `given` wins over what its name says."""
    return [given.get(name) or _default(name) for name in names]


def to_json(meanings: Mapping[str, Meaning]) -> str:
    """Text for the metadata of a network."""
    return json.dumps({name: asdict(meaning) for name, meaning in meanings.items()})


def meanings_from_json(text: str, path: Path) -> dict[str, Meaning]:
    """Read back what `to_json` wrote into the network at `path`."""
    try:
        rows = json.loads(text)
        return {str(name): _meaning(str(name), row, str(path)) for name, row in rows.items()}
    except (json.JSONDecodeError, AttributeError, TypeError) as error:
        raise InputError(f"{path}: metadata classes: cannot be read ({error})") from error
