"""One triangle mesh of all surfaces of a gym, with the shader's vertex attributes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet, GymInstance

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Surface:
    """The gym's triangles.

    Parameters
    ----------
    vertices : (V, 3) float64 world, metres, z up.
    faces : (F, 3) int32.
    normals : (V, 3) float32, unit.
    face_instance : (F,) int32, 0 = none.
    face_facet : (F,) int32, the plane facet of each face, -1 = a hold.
    own : (V, 3) float32, coordinates in the hold's own frame, metres (0 on facets).
    marks : (V, 3) float32, chalk, gloss and steel in 0..1 (0 on facets).
    """

    vertices: Floats
    faces: NDArray[np.int32]
    normals: Singles
    face_instance: NDArray[np.int32]
    face_facet: NDArray[np.int32]
    own: Singles
    marks: Singles


def tessellate(corners: Floats, cell: float) -> tuple[Floats, NDArray[np.int32]]:
    """Cut a triangle or plane quad (3 or 4, 3) into triangles with edges of about `cell`."""
    edges = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    n = max(1, int(np.ceil(edges.max() / cell)))
    if len(corners) == 3:
        return _grid_triangle(corners, n)
    m = max(1, int(np.ceil(max(edges[1], edges[3]) / cell)))
    n = max(1, int(np.ceil(max(edges[0], edges[2]) / cell)))
    s, t = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, m + 1))
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)
    index = np.arange((n + 1) * (m + 1), dtype=np.int32).reshape(m + 1, n + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return weights.reshape(-1, 4) @ corners, faces.astype(np.int32)


def _grid_triangle(corners: Floats, n: int) -> tuple[Floats, NDArray[np.int32]]:
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    keep = i + j <= n
    index = np.full((n + 1, n + 1), -1, np.int32)
    index[keep] = np.arange(int(keep.sum()), dtype=np.int32)
    s, t = i[keep] / n, j[keep] / n
    points = corners[0] + s[:, None] * (corners[1] - corners[0])
    points = points + t[:, None] * (corners[2] - corners[0])
    lower = (i + j < n)[:n, :n]
    upper = (i + j < n - 1)[:n, :n]
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:]
    faces = np.concatenate(
        [
            np.stack([a[lower], b[lower], c[lower]], axis=-1),
            np.stack([b[upper], d[upper], c[upper]], axis=-1),
        ]
    )
    return points, faces.astype(np.int32)


# Surfaces outside the evaluation need fewer triangles.
_CELL_FACTOR = {"floor": 4.0, "concrete": 12.0, "ceiling": 16.0, "plate": 3.0}


def merge_surface(facets: Sequence[Facet], holds: Sequence[GymInstance], cell: float) -> Surface:
    """Return the merged surface: facets first, then the holds in order."""
    parts: list[tuple[Floats, NDArray[np.int32], Floats, int, int, Floats, Singles]] = []
    for number, facet in enumerate(facets):
        factor = _CELL_FACTOR.get(facet.kind, 1.0)
        points, faces = tessellate(facet.corners, cell * factor)
        normal = np.tile(facet.frame[2], (len(points), 1))
        blank = np.zeros((len(points), 3))
        parts.append(
            (points, faces, normal, facet.instance, number, blank, blank.astype(np.float32))
        )
    for hold in holds:
        body, placement = hold.body, hold.placement
        assert body is not None
        assert placement is not None
        points = body.vertices @ placement.rotation.T + placement.origin
        normal = body.normals @ placement.rotation.T
        marks = np.stack([body.chalk, body.gloss, body.steel], axis=1)
        parts.append((points, body.faces, normal, hold.id, -1, body.vertices, marks))
    starts = np.concatenate([[0], np.cumsum([len(p[0]) for p in parts])])
    shifted = [p[1] + np.int32(start) for p, start in zip(parts, starts, strict=False)]

    def per_face(column: int) -> NDArray[np.int32]:
        return np.concatenate([np.full(len(p[1]), p[column], np.int32) for p in parts])

    return Surface(
        np.concatenate([p[0] for p in parts]),
        np.concatenate(shifted).astype(np.int32),
        np.concatenate([p[2] for p in parts]).astype(np.float32),
        per_face(3),
        per_face(4),
        np.concatenate([p[5] for p in parts]).astype(np.float32),
        np.concatenate([p[6] for p in parts]).astype(np.float32),
    )
