"""Mesh files of other programs: opened by trimesh, after what they claim was looked at."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import join_inside

# trimesh knows more, archives among them.
SUFFIXES = (".ply", ".obj", ".glb", ".gltf", ".stl", ".off")
_HEADER = 64_000
_PACKED = 64  # numbers a byte, more than any compression of glTF packs


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
    if path.suffix.lower() in (".glb", ".gltf"):
        _check_accessors(path)

    try:
        return trimesh.load(
            # A file would take memory for any length that it is asked for.
            io.BytesIO(path.read_bytes()),
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


class _Accessor(msgspec.Struct, frozen=True):
    count: Annotated[int, msgspec.Meta(ge=0, le=2**40)] = 0


class _Gltf(msgspec.Struct, frozen=True):
    """As much of glTF's JSON as says how large arrays get."""

    accessors: tuple[_Accessor, ...] = ()


def _check_accessors(path: Path) -> None:
    """Refuse glTF that claims more numbers than its files have: zeros fill what is not there."""
    data = path.read_bytes()
    size = len(data) + sum(item.stat().st_size for item in path.parent.glob("*.bin"))
    if data.startswith(b"glTF"):
        data = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    try:
        table = msgspec.json.decode(data, type=_Gltf)
    except (msgspec.DecodeError, RecursionError) as error:
        raise InputError(f"{path}: damaged: not the JSON of glTF ({error})") from error
    if sum(accessor.count for accessor in table.accessors) > _PACKED * size:
        raise InputError(f"{path}: damaged: it claims more numbers than {size} bytes can hold")


def int32_faces(faces: object) -> NDArray[np.int32]:
    """(F, 3) int32 of faces as a file gave them; an index beyond int32 does not come round."""
    wide = np.asarray(faces, dtype=np.int64)
    return np.clip(wide, -1, 2**31 - 1).astype(np.int32)
