"""`work/light.npz`: the light that the photos were taken in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import atomic_path
from walltopo.scans.arrays import read_arrays

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SceneLight:
    """What to divide out of a hold's colour.

    Parameters
    ----------
    gain : (photos, 3) float64, log gain of each photo (in the order of the sparse model's views)
        and channel; 0 for photos without wall.
    points : (n, 3) float64, centres of wall patches, world frame.
    brightness : (n,) float64, log luminance of the wall around each patch over the scan's
        median, smoothed: how much light falls there.
    colour : (n, 3) float64, log linear RGB of each patch under the scan's mean light.
    wall : median luminance of the wall, linear, under the scan's mean light; 0 if unknown.
    white : factor that brings the scan's brightest paint to the luminance of white paint; 0 while
        nobody has looked for it.
    """

    gain: Floats
    points: Floats
    brightness: Floats
    colour: Floats
    wall: float = 0.0
    white: float = 0.0

    def at(self, positions: Floats) -> Floats:
        """(n,) log brightness of the light at (n, 3) positions; 0 where nothing is known."""
        if len(self.points) == 0:
            return np.zeros(len(positions))
        from scipy.spatial import cKDTree

        _, nearest = cKDTree(self.points).query(positions)
        return self.brightness[nearest]

    def tint_at(self, positions: Floats, radius: float) -> Floats:
        """(n, 3) relative colour of the wall around (n, 3) positions; 1 where nothing is known.

        The mean over the patches, by a Gaussian of `radius`; its own mean over RGB (of logs)
        is 1. Where the wall is of one paint, differences between places are the light's.
        """
        if len(self.points) == 0:
            return np.ones((len(positions), 3))
        away = ((positions[:, None] - self.points[None]) ** 2).sum(axis=2) / (2 * radius**2)
        weight = np.exp(-(away - away.min(axis=1, keepdims=True)))
        logs = weight @ self.colour / weight.sum(axis=1, keepdims=True)
        return np.asarray(np.exp(logs - logs.mean(axis=1, keepdims=True)))

    @classmethod
    def load(cls, path: Path) -> SceneLight:
        """Read.

        Raises
        ------
        InputError : the file is missing or damaged, or its arrays are no such light.
        """
        names = ("gain", "points", "brightness", "colour", "level")
        arrays = read_arrays(path, *names)
        count = len(arrays[1])
        shapes = ((len(arrays[0]), 3), (count, 3), (count,), (count, 3), (2,))
        for name, values, shape in zip(names, arrays, shapes, strict=True):
            if values.shape != shape or values.dtype.kind != "f":
                raise InputError(f"{path}: {name} must be numbers of shape {shape}")
            if not np.isfinite(values).all():
                raise InputError(f"{path}: {name} must be finite")
        gain, points, brightness, colour, level = (v.astype(np.float64) for v in arrays)
        return cls(gain, points, brightness, colour, float(level[0]), float(level[1]))

    def save(self, path: Path) -> None:
        """Write, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(
                stream,
                gain=self.gain,
                points=self.points,
                brightness=self.brightness,
                colour=self.colour,
                level=np.array([self.wall, self.white]),
            )
