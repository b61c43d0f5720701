"""NumPy arrays of a `.npz` file."""

from __future__ import annotations

import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError

__all__ = ["read_arrays"]

# What zipfile and NumPy raise on bytes that are not theirs (RuntimeError: "is encrypted").
_DAMAGED = (
    EOFError,
    OSError,
    RuntimeError,
    ValueError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


def read_arrays(path: Path, *names: str) -> list[NDArray[Any]]:
    """The named arrays of a `.npz` file.

    Raises
    ------
    InputError : the file is missing or damaged, or an array is not in it; names the file.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file")
    try:
        # Not `np.load`: it takes whatever else there is for a pickle or a single array.
        with zipfile.ZipFile(path), np.load(path) as data:
            return [data[name] for name in names]
    except KeyError as error:
        raise InputError(f"{path}: holds no such array ({error})") from error
    except _DAMAGED as error:
        raise InputError(f"{path}: not a readable .npz file ({error})") from error
