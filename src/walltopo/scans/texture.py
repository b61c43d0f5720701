"""`texture.png` and `texture.npz`: the mesh's picture and where each triangle lies in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.files import atomic_path, move_into_place
from walltopo.scans.arrays import read_arrays

__all__ = ["TextureImage", "TextureUv"]


@dataclass(frozen=True)
class TextureImage:
    """The atlas, an sRGB PNG; read by those who need its pixels."""

    path: Path

    @classmethod
    def load(cls, path: Path) -> TextureImage:
        """The file; InputError where it is missing."""
        if not path.is_file():
            raise InputError(f"{path}: no such texture")
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the file to `path`, atomically."""
        move_into_place(self.path, path)


@dataclass(frozen=True, eq=False)
class TextureUv:
    """`uv` : (F, 3, 2) float32 in [0, 1], origin at the image's top left."""

    uv: NDArray[np.float32]

    @classmethod
    def load(cls, path: Path) -> TextureUv:
        """Read; InputError where the file is missing, damaged or of another shape."""
        (uv,) = read_arrays(path, "uv")
        if uv.dtype.kind != "f" or uv.shape[1:] != (3, 2) or not np.isfinite(uv).all():
            raise InputError(f"{path}: uv must be finite numbers (F, 3, 2), got {uv.shape}")
        return cls(uv.astype(np.float32))

    def save(self, path: Path) -> None:
        """Write, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, uv=self.uv)

    def check_fits(self, mesh: Mesh) -> None:
        """InputError where the mesh has another number of triangles."""
        if self.uv.shape != (len(mesh.faces), 3, 2):
            raise InputError(
                f"texture: the mesh has {len(mesh.faces)} triangles, uv is {self.uv.shape}",
                "mesh.ply and texture.npz are of different runs; run the scan again.",
            )
