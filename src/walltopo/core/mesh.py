"""Define the triangle mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walltopo.core.errors import InputError

Floats = NDArray[np.float64]

_PART = 1 << 18  # triangles whose sides are in memory at once


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh in the world frame (metres in a scaled scan).

    Parameters
    ----------
    vertices : (V, 3) float64, finite.
    faces : (F, 3) int32, counter-clockwise seen from outside.
    vertex_colours : (V, 3) uint8 sRGB, or None.
    guessed : (F,) bool, triangles that span a hole and were not measured; stored as None if no
        triangle is guessed.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> mesh = Mesh(corners, np.array([[0, 1, 2]], dtype=np.int32))
    >>> mesh.areas.tolist(), mesh.normals.tolist()
    ([0.5], [[0.0, 0.0, 1.0]])
    """

    vertices: Floats
    faces: NDArray[np.int32]
    vertex_colours: NDArray[np.uint8] | None = None
    guessed: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        faces = np.ascontiguousarray(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise InputError(f"mesh vertices: expected (V, 3), got {vertices.shape}")
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise InputError(f"mesh faces: expected (F, 3), got {faces.shape}")
        bad = ~np.isfinite(vertices).all(axis=1)
        if bad.any():
            raise InputError(
                f"mesh: {int(bad.sum())} vertices are NaN or infinite (first: {int(bad.argmax())})",
                "Clean the mesh first; `walltopo mesh check FILE` lists what is wrong.",
            )
        if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise InputError(
                f"mesh faces: indices must be in 0..{len(vertices) - 1}, "
                f"got {faces.min()}..{faces.max()}"
            )
        colours = self.vertex_colours
        if colours is not None and colours.shape != vertices.shape:
            raise InputError(f"mesh vertex colours: expected {vertices.shape}, got {colours.shape}")
        if self.guessed is not None and self.guessed.shape != (len(faces),):
            raise InputError(f"mesh.guessed: expected ({len(faces)},), got {self.guessed.shape}")
        if self.guessed is not None and not self.guessed.any():
            object.__setattr__(self, "guessed", None)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    @cached_property
    def centroids(self) -> Floats:
        """Return the (F, 3) triangle centroids."""
        total = self.vertices[self.faces[:, 0]]
        for corner in self.faces.T[1:]:
            total += self.vertices[corner]
        total /= 3.0
        return total

    @cached_property
    def areas(self) -> Floats:
        """Return the (F,) triangle areas, square metres."""
        return triangle_areas(self.vertices, self.faces)

    @cached_property
    def normals(self) -> Floats:
        """Return the (F, 3) unit normals; zeros for triangles without area."""
        normals = np.zeros((len(self.faces), 3))
        for part, crosses in _crosses(self.vertices, self.faces):
            lengths = 2.0 * self.areas[part]
            for k, cross in enumerate(crosses):
                np.divide(cross, lengths, out=normals[part, k], where=lengths > 0)
        return normals

    @cached_property
    def measured(self) -> NDArray[np.bool_]:
        """Return (F,) whether photos measured each triangle, the inverse of `guessed`."""
        return np.ones(len(self.faces), np.bool_) if self.guessed is None else ~self.guessed

    def without_guesses(self) -> Mesh:
        """Return the mesh of the measured triangles, without vertices of guessed triangles only.

        Areas, votes and accuracy use this mesh. A mesh without guesses is returned unchanged.
        """
        if self.measured.all():
            return self
        kept = np.ones(len(self.vertices), dtype=np.bool_)
        kept[self.faces[~self.measured]] = False
        kept[self.faces[self.measured]] = True
        number = np.cumsum(kept, dtype=np.int32) - 1
        colours = None if self.vertex_colours is None else self.vertex_colours[kept]
        return Mesh(self.vertices[kept], number[self.faces[self.measured]], colours)


def triangle_areas(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> Floats:
    """Return the (F,) areas of triangles with (V, 3) vertices."""
    areas = np.empty(len(faces))
    for part, (x, y, z) in _crosses(vertices, faces):
        areas[part] = 0.5 * np.sqrt(x * x + y * y + z * z)
    return areas


def _crosses(
    vertices: NDArray[np.floating], faces: NDArray[np.integer]
) -> Iterator[tuple[slice, list[Floats]]]:
    """Yield the cross products of two sides, by axis, of `_PART` triangles at a time."""
    # NumPy is slow on rows of three numbers.
    axes = [np.ascontiguousarray(axis, dtype=np.float64) for axis in vertices.T]
    for begin in range(0, len(faces), _PART):
        part = slice(begin, begin + _PART)
        corners = [[axis[corner] for corner in faces[part].T] for axis in axes]
        first, second = [b - a for a, b, _ in corners], [c - a for a, _, c in corners]
        turns = ((1, 2), (2, 0), (0, 1))
        yield part, [first[i] * second[j] - first[j] * second[i] for i, j in turns]
