"""Mesh files of other programs: opened by trimesh, after what they claim was looked at."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.inside import join_inside

__all__ = ["SUFFIXES", "int32_faces", "load_foreign"]

# trimesh knows more, archives among them.
SUFFIXES = (".ply", ".obj", ".glb", ".gltf", ".stl", ".off")
_HEADER = 64_000


def load_foreign(path: Path) -> Any:
    """A mesh file as trimesh gives it: a `Trimesh`, `Scene` or `PointCloud`.

    Files that it refers to are read from its own folder only, and pictures not at all.

    Raises
    ------
    InputError : the file is missing, of a kind that is not read, damaged, or claims more than
        there is in it.
    """
    import trimesh

    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: not a mesh file; expected one of {', '.join(SUFFIXES)}")
    if path.suffix.lower() == ".ply":
        _check_counts(path)

    try:
        with path.open("rb") as stream:
            return trimesh.load(
                stream,
                file_type=path.suffix[1:].lower(),
                resolver=_beside(path.parent),
                process=False,
                maintain_order=True,
            )
    except Exception as error:  # trimesh raises many kinds for broken files
        raise InputError(f"{path}: cannot be read as a mesh ({error})") from error


def _beside(folder: Path) -> Any:
    """What trimesh asks for the files that a mesh refers to: materials and buffers beside it."""
    from trimesh.resolvers import Resolver

    class Beside(Resolver):
        def __init__(self) -> None:
            pass

        def get(self, name: str) -> bytes:
            found = join_inside(folder, name)
            if found.suffix.lower() not in (".mtl", ".bin"):
                raise FileNotFoundError(name)
            return found.read_bytes()

        def write(self, name: str, data: bytes) -> None:
            raise PermissionError(name)

        def keys(self) -> list[str]:
            return []

        def namespaced(self, namespace: str) -> Beside:
            return self

    return Beside()


def _check_counts(path: Path) -> None:
    """Refuse a PLY that claims more entries than it has bytes: arrays are made by these counts."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(_HEADER).partition(b"end_header")[0]
    for count in re.findall(rb"^\s*element\s+\S+\s+(\S+)", head, flags=re.MULTILINE):
        if not count.isdigit() or len(count) > 18 or int(count) > size:
            told = count[:20].decode("ascii", "replace")
            raise InputError(f"{path}: damaged: it claims {told} entries in {size} bytes")


def int32_faces(faces: object) -> NDArray[np.int32]:
    """(F, 3) int32 of faces as a file gave them; an index beyond int32 does not come round."""
    wide = np.asarray(faces, dtype=np.int64)
    return np.clip(wide, -1, 2**31 - 1).astype(np.int32)
