"""JSON files of declared shape: the base of every document in the scan folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import msgspec

from walltopo.core.errors import InputError, naming
from walltopo.core.files import read_json, write_json

__all__ = ["Document", "parse", "read_document"]

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
