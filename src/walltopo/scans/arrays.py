"""NumPy arrays of a `.npz` file."""

from __future__ import annotations

import math
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError

MOST_BYTES = 2 << 30  # texture coordinates of ninety million triangles
# What zipfile and NumPy raise on bytes that are not theirs (RuntimeError: "is encrypted").
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
    """The named arrays of a `.npz` file.

    Raises
    ------
    InputError : the file is missing or damaged, or an array is not in it; names the file.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        # Not `np.load`: it takes whatever else there is for a pickle or a single array.
        with zipfile.ZipFile(path) as archive:
            return [_array(archive, name, path) for name in names]
    except KeyError as error:
        raise InputError(f"{path}: holds no such array ({error})") from error
    except _DAMAGED as error:
        raise InputError(f"{path}: not a readable .npz file ({error})") from error


def _array(archive: zipfile.ZipFile, name: str, path: Path) -> NDArray[Any]:
    """One array, after what it declares was held against what is there."""
    told = archive.getinfo(f"{name}.npy")
    if told.file_size > MOST_BYTES:
        raise InputError(f"{path}: {name} claims {told.file_size} bytes, too many for a scan")
    with archive.open(told) as stream:
        version = np.lib.format.read_magic(stream)
        read = {(1, 0): np.lib.format.read_array_header_1_0}.get(
            version, np.lib.format.read_array_header_2_0
        )
        shape, _, kind = read(stream)
        head = stream.tell()
    size = math.prod(shape) * kind.itemsize
    if kind.hasobject or min(shape, default=1) < 0 or head + size != told.file_size:
        raise InputError(
            f"{path}: not a readable .npz file ({name} claims {kind} {shape}, "
            f"the archive has {told.file_size - head} bytes of it)"
        )
    with archive.open(told) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)
