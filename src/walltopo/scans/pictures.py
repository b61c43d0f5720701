"""Pictures of a scan, and the light of its photos."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.files import atomic_path, check_name, move_into_place
from walltopo.scans.document import Count, Document, FileName, Label, read_arrays


@dataclass(frozen=True)
class TextureImage:
    """The texture atlas, an sRGB PNG, which is read only when its pixels are needed."""

    path: Path

    @classmethod
    def load(cls, path: Path) -> TextureImage:
        """Return the image; raise InputError if the file is missing."""
        if not path.is_file():
            raise InputError(f"{path}: the texture does not exist")
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
        """Return the checked array; raise InputError if the file is missing, damaged or invalid."""
        (uv,) = read_arrays(path, "uv")
        if uv.dtype.kind != "f" or uv.shape[1:] != (3, 2) or not np.isfinite(uv).all():
            raise InputError(f"{path}: uv must be finite numbers (F, 3, 2), got {uv.shape}")
        return cls(uv.astype(np.float32))

    def save(self, path: Path) -> None:
        """Write the file, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, uv=self.uv)

    def check_fits(self, mesh: Mesh) -> None:
        """Raise InputError if the mesh has another number of triangles."""
        if self.uv.shape != (len(mesh.faces), 3, 2):
            raise InputError(
                f"texture: the mesh has {len(mesh.faces)} triangles, uv is {self.uv.shape}",
                "mesh.ply and texture.npz are from different runs; run the scan again.",
            )


INDEX = "index.json"


class Cutout(msgspec.Struct, frozen=True):
    """One picture of a hold.

    Parameters
    ----------
    id : id of the hold; file : in `cutouts/`; photo : name of the photo.
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
        """Return the cutouts of a folder; raise InputError if the index is missing or invalid."""
        return cls(path, CutoutIndex.load(path / INDEX).cutouts)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    def best(self) -> dict[int, Path]:
        """Return hold id to the file of its best cutout."""
        found: dict[int, Path] = {}
        for entry in self.index:
            found.setdefault(entry.id, self.folder / entry.file)
        return found


@dataclass(frozen=True)
class Made:
    """A file or a folder, which is moved into place when it is stored."""

    path: Path

    @classmethod
    def load(cls, path: Path) -> Made:
        """Return the file at `path`."""
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the file to `path`, atomically."""
        move_into_place(self.path, path)


Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SceneLight:
    """The light to divide out of a hold's colour.

    Parameters
    ----------
    gain : (photos, 3) float64, log gain of each photo (in the order of the sparse model's views)
        and channel; 0 for photos without wall.
    points : (n, 3) float64, centres of wall patches, world frame.
    colour : (n, 3) float64, log linear RGB of each patch under the scan's mean light.
    wall : median luminance of the wall, linear, under the scan's mean light; 0 if unknown.
    white : factor that brings the scan's brightest paint to the luminance of white paint; 0 if not
        computed yet.
    """

    gain: Floats
    points: Floats
    colour: Floats
    wall: float = 0.0
    white: float = 0.0

    def factor(self, photo: int) -> Floats:
        """Return (3,) the factor from linear RGB in a photo to that under the scan's light."""
        return np.asarray(np.exp(-self.gain[photo]) * (self.white or 1.0))

    def tint_at(self, positions: Floats, radius: float) -> Floats:
        """Return (n, 3) relative colour of the wall around (n, 3) positions; 1 without any patch.

        The mean over the patches, weighted by a Gaussian of `radius` and normalised to a mean log
        of 0 over RGB. On a wall of one paint, its differences are those of the light.
        """
        if len(self.points) == 0:
            return np.ones((len(positions), 3))
        away = ((positions[:, None] - self.points[None]) ** 2).sum(axis=2) / (2 * radius**2)
        weight = np.exp(-(away - away.min(axis=1, keepdims=True)))
        logs = weight @ self.colour / weight.sum(axis=1, keepdims=True)
        return np.asarray(np.exp(logs - logs.mean(axis=1, keepdims=True)))

    @classmethod
    def load(cls, path: Path) -> SceneLight:
        """Return the checked light of a file.

        Raises
        ------
        InputError : the file is missing or damaged, or its arrays are invalid.
        """
        names = ("gain", "points", "colour", "level")
        arrays = read_arrays(path, *names)
        count = len(arrays[1])
        shapes = ((len(arrays[0]), 3), (count, 3), (count, 3), (2,))
        for name, values, shape in zip(names, arrays, shapes, strict=True):
            if values.shape != shape or values.dtype.kind != "f":
                raise InputError(f"{path}: {name} must be numbers of shape {shape}")
            if not np.isfinite(values).all():
                raise InputError(f"{path}: {name} must be finite")
        gain, points, colour, level = (v.astype(np.float64) for v in arrays)
        return cls(gain, points, colour, float(level[0]), float(level[1]))

    def save(self, path: Path) -> None:
        """Write the file, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(
                stream,
                gain=self.gain,
                points=self.points,
                colour=self.colour,
                level=np.array([self.wall, self.white]),
            )
