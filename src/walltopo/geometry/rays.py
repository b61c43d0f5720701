"""Single rays against a mesh: a thin, exact-in-float64 wrapper of Embree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError

Floats = NDArray[np.float64]


class Bvh:
    """A bounding volume hierarchy over the triangles of a mesh.

    Parameters
    ----------
    vertices : (V, 3) float, world frame.
    faces : (F, 3) int.

    Notes
    -----
    Embree works in float32. The mesh is therefore moved and scaled into a unit box before it is
    handed over, so that a model in millimetres far from its origin loses nothing, and the
    distance is computed again in float64 from the plane of the triangle that was hit.
    """

    def __init__(self, vertices: Floats, faces: NDArray[np.int32]) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self._faces = np.ascontiguousarray(faces, dtype=np.int32)
        if len(self._faces) == 0:
            self._offset, self._factor, self._scene = np.zeros(3), 1.0, None
            return
        used = self._vertices[self._faces]
        low, high = used.min(axis=(0, 1)), used.max(axis=(0, 1))
        self._offset = (low + high) / 2
        extent = float((high - low).max())
        self._factor = 1.0 / extent if extent > 0 else 1.0
        self._scene = EmbreeScene()
        small = ((used - self._offset) * self._factor).astype(np.float32)
        self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(small))

    def first_hit(
        self, origins: Floats, directions: Floats
    ) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """The first triangle that each ray meets, from either side.

        Parameters
        ----------
        origins : (n, 3) float, world frame.
        directions : (n, 3) float, of any length > 0.

        Returns
        -------
        face : (n,) int32, -1 where the ray meets nothing.
        t : (n,) float64, the hit is at `origins + t * directions`; inf where there is none.
        """
        origins = np.ascontiguousarray(origins, dtype=np.float64)
        directions = np.ascontiguousarray(directions, dtype=np.float64)
        if origins.shape != directions.shape or origins.ndim != 2 or origins.shape[1] != 3:
            raise InputError(
                f"rays: origins and directions must both be (n, 3), got {origins.shape} "
                f"and {directions.shape}"
            )
        t = np.full(len(origins), np.inf)
        if self._scene is None or len(origins) == 0:
            return np.full(len(origins), -1, dtype=np.int32), t
        lengths = np.linalg.norm(directions, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise InputError("rays: a direction has no length")
        start = ((origins - self._offset) * self._factor).astype(np.float32)
        face = np.array(
            self._scene.run(start, (directions / lengths).astype(np.float32)), dtype=np.int32
        )
        hit = np.flatnonzero(face >= 0)
        t[hit] = self._plane_distance(face[hit], origins[hit], directions[hit])
        return face, t

    def _plane_distance(
        self, face: NDArray[np.int32], origins: Floats, directions: Floats
    ) -> Floats:
        a, b, c = (self._vertices[self._faces[face, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        towards = np.einsum("ij,ij->i", directions, normals)
        gap = np.einsum("ij,ij->i", a - origins, normals)
        # A ray that grazes its triangle has no stable plane distance: take the nearest corner's.
        grazing = np.abs(towards) < 1e-12 * np.linalg.norm(normals, axis=1)
        along = np.einsum("ij,ij->i", a - origins, directions) / (directions**2).sum(axis=1)
        return np.where(grazing, along, gap / np.where(grazing, 1.0, towards))
