"""JSON files of a declared shape, with bounded numbers and names."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec

from walltopo.core.errors import InputError, naming
from walltopo.core.files import read_json, write_json
from walltopo.core.mask import MOST_SIDE

T = TypeVar("T")

Doc = TypeVar("Doc", bound="Document")


class Document(msgspec.Struct, frozen=True, kw_only=True):
    """A JSON file of the scan folder; its fields are the file's keys, in their order.

    Keys that are not declared are passed over: files of an older or a newer walltopo can be read
    as far as they agree.
    """

    version: int = 1

    @classmethod
    def load(cls: type[Doc], path: Path) -> Doc:
        """Read and check.

        Raises
        ------
        InputError : the file is missing, not JSON or of another shape; names file and place.
        """
        return read_document(path, cls)

    def save(self, path: Path) -> None:
        """Write, atomically."""
        write_json(path, msgspec.to_builtins(self, str_keys=True))


def parse(value: Any, kind: type[T], where: str) -> T:
    """Plain values (of JSON or TOML) as `kind`.

    Raises
    ------
    InputError : another shape; begins with `where` and names the place.
    """
    try:
        with naming(where):  # classes may check more than their fields' types
            return msgspec.convert(value, kind, strict=True)
    except (msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{where}: {error}") from error


def read_document(path: Path, kind: type[T]) -> T:
    """A JSON file as `kind`; see `parse` and `read_json` for what can be wrong."""
    return parse(read_json(path), kind, str(path))


Label = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]  # an id as arrays hold it; 0 = none

Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]

Level = Annotated[int, msgspec.Meta(ge=0, le=255)]

Share = Annotated[float, msgspec.Meta(ge=0, le=1)]

Side = Annotated[int, msgspec.Meta(ge=1, le=MOST_SIDE)]  # of a picture, pixels

Rgb = tuple[Level, Level, Level]  # sRGB

# No wall reaches so far, and squares of it are still exact enough.
Coordinate = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]

# Scan units in a metre.
Unit = Annotated[float, msgspec.Meta(gt=0, le=1e6)]

# The class that has one calls `check_name` on it.
FileName = Annotated[str, msgspec.Meta(min_length=1, extra={"is": "file name"})]


def check_once(what: str, values: Iterable[Hashable]) -> None:
    """Refuse a value that occurs twice; InputError names it."""
    seen: set[Hashable] = set()
    for value in values:
        if value in seen:
            raise InputError(f"{what} {value} occurs twice")
        seen.add(value)
