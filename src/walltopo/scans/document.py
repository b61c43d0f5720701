"""Files of a declared shape: JSON documents and arrays, with limits on numbers and names."""

from __future__ import annotations

import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Hashable, Iterable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core.errors import InputError, prefix_errors
from walltopo.core.files import read_json, write_json
from walltopo.core.view import MAX_SIDE

T = TypeVar("T")

Doc = TypeVar("Doc", bound="Document")


class Document(msgspec.Struct, frozen=True, kw_only=True):
    """A JSON file of the scan folder; its fields are the file's keys, in their order.

    Undeclared keys are ignored, so that files of older and newer versions can be read as far as
    they agree.
    """

    version: int = 1

    @classmethod
    def load(cls: type[Doc], path: Path) -> Doc:
        """Return the checked content of a file.

        Raises
        ------
        InputError : the file is missing, not JSON or of another shape (the message says where).
        """
        return read_document(path, cls)

    def save(self, path: Path) -> None:
        """Write the file, atomically."""
        write_json(path, msgspec.to_builtins(self, str_keys=True))


def parse(value: Any, kind: type[T], where: str) -> T:
    """Return plain values (of JSON or TOML) as `kind`.

    Raises
    ------
    InputError : the values have another shape; the message begins with `where`.
    """
    try:
        with prefix_errors(where):  # a class may check more than the types of its fields
            return msgspec.convert(value, kind, strict=True)
    except (msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{where}: {error}") from error


def read_document(path: Path, kind: type[T]) -> T:
    """Return a JSON file as `kind`; raises the errors of `parse` and `read_json`."""
    return parse(read_json(path), kind, str(path))


Label = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]  # an id as in arrays; 0 = none

Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]

Level = Annotated[int, msgspec.Meta(ge=0, le=255)]

Share = Annotated[float, msgspec.Meta(ge=0, le=1)]

Side = Annotated[int, msgspec.Meta(ge=1, le=MAX_SIDE)]  # of a picture, pixels

Rgb = tuple[Level, Level, Level]  # sRGB

# Larger than any wall, and small enough for exact squares.
Coordinate = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]

# Scan units per metre.
Unit = Annotated[float, msgspec.Meta(gt=0, le=1e6)]

# A class with such a field calls `check_name` on it.
FileName = Annotated[str, msgspec.Meta(min_length=1, extra={"is": "file name"})]


def check_once(what: str, values: Iterable[Hashable]) -> None:
    """Raise InputError if a value occurs twice; the message names it."""
    seen: set[Hashable] = set()
    for value in values:
        if value in seen:
            raise InputError(f"{what} {value} occurs twice")
        seen.add(value)


MAX_BYTES = 2 << 30  # texture coordinates of ninety million triangles
# The exceptions of zipfile and NumPy on damaged files (RuntimeError: "is encrypted").
_DAMAGED = (
    EOFError,
    MemoryError,
    NotImplementedError,
    OSError,
    RecursionError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def read_arrays(path: Path, *names: str) -> list[NDArray[Any]]:
    """Return the named arrays of a `.npz` file.

    Raises
    ------
    InputError : the file is missing or damaged, or lacks an array (the message names the file).
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        # `np.load` would accept a pickle or a single array as well.
        with zipfile.ZipFile(path) as archive:
            return [_read_array(archive, name, path) for name in names]
    except KeyError as error:
        raise InputError(f"{path}: lacks an array ({error})") from error
    except _DAMAGED as error:
        raise InputError(f"{path}: not a readable .npz file ({error})") from error


def _read_array(archive: zipfile.ZipFile, name: str, path: Path) -> NDArray[Any]:
    """Return one array, after checking its declared size against the archive."""
    entry = archive.getinfo(f"{name}.npy")
    if entry.file_size > MAX_BYTES:
        raise InputError(f"{path}: {name} declares {entry.file_size} bytes, too many for a scan")
    with archive.open(entry) as stream:
        version = np.lib.format.read_magic(stream)
        read = {(1, 0): np.lib.format.read_array_header_1_0}.get(
            version, np.lib.format.read_array_header_2_0
        )
        shape, _, kind = read(stream)
        head = stream.tell()
    size = math.prod(shape) * kind.itemsize
    if kind.hasobject or min(shape, default=1) < 0 or head + size != entry.file_size:
        raise InputError(
            f"{path}: not a readable .npz file ({name} declares {kind} {shape}, "
            f"the archive has {entry.file_size - head} bytes)"
        )
    with archive.open(entry) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)
