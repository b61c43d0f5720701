"""Finished tiers, kept in `work/tiers`: an edit of names or labels makes no geometry anew.

A tier is what its wall's shape, texture and settings make it; its tables are written anew each
time, and where labels changed since it was made, it is relabelled (`relabel.py`).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import atomic_path, hash_path
from walltopo.publish.floaters import Hidden
from walltopo.publish.meshopt import available
from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import Surface
from walltopo.publish.wall_data import Wall
from walltopo.scans.arrays import read_arrays

TIERS = "tiers"  # the folder's name, in `work/`

VERSION = 4  # raised when tiers are made otherwise
# Beyond this share of the mesh's triangles a change is no edit: another lift, say.
MOST_CHANGED = 0.05
_SURFACE = tuple(field.name for field in fields(Surface))


@dataclass(frozen=True, eq=False)
class KeptTier:
    """One finished tier.

    Parameters
    ----------
    labels : (F,) int32 of the wall, as the tier was made with.
    picture : the encoded texture and its MIME type; None without a texture.
    """

    surface: Surface
    labels: NDArray[np.int32]
    picture: tuple[bytes, str] | None


class TierShelf:
    """Tiers of one wall by name, in a folder that may be deleted at any time."""

    def __init__(self, folder: Path, wall: Wall, settings: ExportSettings, hidden: Hidden) -> None:
        self._folder = folder
        self._key = _key_of(wall, settings)
        self._hidden = hidden
        self._labels = wall.face_instance

    def get(self, name: str) -> KeptTier | None:
        """The tier as it was made; None where none fits this wall."""
        path = self._folder / f"{name}.npz"
        if not path.is_file():
            return None
        names = (*_SURFACE, "labels", "picture", "mime", "key")
        try:
            values = dict(zip(names, read_arrays(path, *names), strict=True))
        except InputError:  # a cache: what cannot be read is made again
            return None
        if values["key"].tobytes() != self._key or len(values["labels"]) != len(self._labels):
            return None
        if not self._serves(values["labels"]):
            return None
        parts: dict[str, Any] = {
            part: values[part] if values[part].size else None for part in _SURFACE
        }
        picture = values["picture"].tobytes(), values["mime"].tobytes().decode("ascii")
        return KeptTier(Surface(**parts), values["labels"], picture if picture[0] else None)

    def _serves(self, before: NDArray[np.int32]) -> bool:
        """Whether a tier made with these labels can be relabelled."""
        changed = np.count_nonzero(before != self._labels)
        if changed == 0 or changed > MOST_CHANGED * len(self._labels):
            return changed == 0
        # Surface is shown or left out by the holds on it.
        return bool((self._hidden.of(before) == self._hidden.of(self._labels)).all())

    def put(self, name: str, tier: KeptTier) -> None:
        """Keep a tier that was made for this wall."""
        picture, mime = tier.picture or (b"", "")
        none = np.zeros(0, dtype=np.uint8)
        parts: dict[str, Any] = {
            part: none if (value := getattr(tier.surface, part)) is None else value
            for part in _SURFACE
        }
        parts["labels"] = tier.labels
        for name_of, data in (("picture", picture), ("mime", mime.encode()), ("key", self._key)):
            parts[name_of] = np.frombuffer(data, dtype=np.uint8)
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._folder / f"{name}.npz"
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez(stream, **parts)


def _key_of(wall: Wall, settings: ExportSettings) -> bytes:
    """What a tier follows from, but for the labels."""
    sizes = {name: value for name, value in vars(settings).items() if name != "title"}
    told = repr((VERSION, available(), sorted(sizes.items())))
    digest = hashlib.blake2b(told.encode(), digest_size=16)
    mesh = wall.mesh
    for values in (mesh.vertices, mesh.faces, wall.uv, mesh.vertex_colours, mesh.guessed):
        if values is not None:
            digest.update(np.ascontiguousarray(values).data)
    for view in wall.views:
        digest.update(repr(view.camera).encode() + view.cam_from_world.tobytes())
    if wall.texture is not None:
        digest.update(hash_path(wall.texture).encode())
    return digest.digest()
