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
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from walltopo.core import InputError
from walltopo.core.toml import read_toml
from walltopo.scans.document import parse

__all__ = ["ROLES", "Meaning", "meanings_from_json", "meanings_of", "read_classes", "to_json"]

ROLES = ("hold", "volume", "downclimb")


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


class _Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a file says of a class; see `Meaning`."""

    type: str | None = None
    colour: str = ""
    role: Literal["hold", "volume", "downclimb"] | None = None

    def meaning(self, name: str) -> Meaning:
        """With what its name says where the file says nothing."""
        default = _default(name)
        type_ = default.type if self.type is None else self.type
        return Meaning(type_, self.colour, self.role or default.role)


class _Class(_Row, frozen=True, kw_only=True):
    name: Annotated[str, msgspec.Meta(min_length=1)]


class _Classes(msgspec.Struct, frozen=True):
    classes: tuple[_Class, ...] = msgspec.field(name="class", default=())


def read_classes(path: Path) -> dict[str, Meaning]:
    """Read a `classes.toml`.

    Raises
    ------
    InputError : the file is missing, is not TOML, or an entry is wrong; names which.
    """
    hint = "See docs/colours.md for its format."
    found: dict[str, Meaning] = {}
    for row in parse(read_toml(path, hint), _Classes, str(path)).classes:
        if row.name in found:
            raise InputError(f"{path}: class {row.name!r} is there twice")
        found[row.name] = row.meaning(row.name)
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
        rows = msgspec.json.decode(text, type=dict[str, _Row])
    except (msgspec.DecodeError, RecursionError) as error:
        raise InputError(f"{path}: metadata classes: cannot be read ({error})") from error
    return {name: row.meaning(name) for name, row in rows.items()}
