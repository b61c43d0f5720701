"""`texture.png`, `texture.npz`, `cutouts/`, and finished files that no later stage reads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.files import atomic_path, check_name, move_into_place
from walltopo.scans.arrays import read_arrays
from walltopo.scans.document import Count, Document, FileName, Label


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


INDEX = "index.json"


class Cutout(msgspec.Struct, frozen=True):
    """One picture of a hold.

    Parameters
    ----------
    id : of the hold; file : in `cutouts/`; photo : it was cut from.
    pixels : visible pixels of the hold; sharpness : variance of the Laplacian.
    cut : the hold touches the photo's border.
    """

    id: Label
    file: FileName
    photo: str
    pixels: Count
    sharpness: float
    cut: bool

    def __post_init__(self) -> None:
        check_name(self.file)


class CutoutIndex(Document, frozen=True, kw_only=True):
    """`cutouts/index.json`: the best picture of each hold first."""

    cutouts: tuple[Cutout, ...]


@dataclass(frozen=True)
class Cutouts:
    """A folder of cutouts with its index."""

    folder: Path
    index: tuple[Cutout, ...]

    @classmethod
    def load(cls, path: Path) -> Cutouts:
        """Read the index; InputError where it is missing or broken."""
        return cls(path, CutoutIndex.load(path / INDEX).cutouts)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    def best(self) -> dict[int, Path]:
        """Hold id to the file of its best cutout."""
        found: dict[int, Path] = {}
        for entry in self.index:
            found.setdefault(entry.id, self.folder / entry.file)
        return found


@dataclass(frozen=True)
class Made:
    """A file or a folder; moved to its place when it is stored."""

    path: Path

    @classmethod
    def load(cls, path: Path) -> Made:
        """Return the file where it lies."""
        return cls(path)

    def save(self, path: Path) -> None:
        """Move it to `path`, atomically."""
        move_into_place(self.path, path)
