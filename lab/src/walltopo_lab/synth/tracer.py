"""Ray casting against the gym with Embree."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]


class Tracer:
    """A BVH over triangles.

    Parameters
    ----------
    vertices : (V, 3) float, metres.
    faces : (F, 3) int32.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh

        triangles = np.ascontiguousarray(vertices[faces], dtype=np.float32)
        self._scene = rtcore_scene.EmbreeScene()
        self._mesh = TriangleMesh(self._scene, triangles)

    def hits(self, origins: Singles, directions: Singles) -> dict[str, Any]:
        """Return the first hits as arrays of length n.

        `primID` int32 is the face (-1 none), `u` and `v` are weights of corners 1 and 2, `tfar` is
        the distance in units of the direction's length.
        """
        return dict(self._scene.run(origins, directions, output=1))

    def distances(self, origins: Singles, directions: Singles) -> Singles:
        """Return (n,) distance to the first hit, very large without a hit."""
        return np.asarray(self._scene.run(origins, directions, query="DISTANCE"), np.float32)
