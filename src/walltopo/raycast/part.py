"""What a photo shows of a mesh, drawn from the triangles that may lie in it alone.

Over all photos, the time so grows with what they show, and not with photos times triangles.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh
from walltopo.raycast.triangles import triangles_of_mesh
from walltopo.raycast.zbuffer import render_ids

__all__ = ["faces_before", "own_vertices", "render_part"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_MOST = 0.5  # of the triangles; where more lie in a photo, picking them out saves nothing
WIDEST = 1.2  # radians: a picture that needs more than such a cone is drawn from the whole mesh
MORE = 0.02  # radians that a cone is wider than needed: its mantle is tried at some places alone


def render_part(
    mesh: Mesh, camera: Camera, cam_from_world: Floats
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """As `render_ids` of the whole mesh."""
    rows = faces_before(mesh, camera, cam_from_world)
    if len(rows) > _MOST * len(mesh.faces):
        return render_ids(mesh.vertices, mesh.faces, camera, cam_from_world)
    vertices, faces = own_vertices(mesh, rows)
    face, depth = render_ids(vertices, faces, camera, cam_from_world)
    seen = face >= 0
    face[seen] = rows[face[seen]]
    return face, depth


def faces_before(mesh: Mesh, camera: Camera, cam_from_world: Floats) -> Ints:
    """(n,) ascending: all triangles that may lie in a picture, and some besides.

    Parameters
    ----------
    cam_from_world : (3, 4).
    """
    axis, half_angle = cone_of(camera)
    rotation = cam_from_world[:, :3]
    centre = -rotation.T @ cam_from_world[:, 3]
    return triangles_of_mesh(mesh).towards(centre, axis @ rotation, half_angle)


def own_vertices(mesh: Mesh, rows: Ints) -> tuple[Floats, NDArray[np.int32]]:
    """The vertices of some triangles (V, 3), in their order, and these triangles on them (n, 3)."""
    corners = mesh.faces[rows]
    used = np.zeros(len(mesh.vertices), dtype=np.bool_)
    used[corners.ravel()] = True
    place = np.cumsum(used, dtype=np.int32) - 1
    return mesh.vertices[used], place[corners].astype(np.int32)


@lru_cache(maxsize=256)
def cone_of(camera: Camera) -> tuple[Floats, float]:
    """A cone of all rays of a picture: its axis (3,) unit, camera frame, and half its angle.

    It is widened until no ray on its mantle is drawn in the picture any more: so it is right for
    any lens.
    """
    size = np.array([camera.width, camera.height])
    middle = (size / 2 - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    axis = np.append(middle, 1.0)
    axis /= np.linalg.norm(axis)
    right = np.cross(axis, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    turn = np.arange(0, 2 * np.pi, np.pi / 16)
    around = np.outer(np.cos(turn), right) + np.outer(np.sin(turn), np.cross(axis, right))
    half_angle = 0.02
    while half_angle < WIDEST:
        pixels = camera.project(axis + np.tan(half_angle) * around)
        inside = ((pixels >= 0) & (pixels <= size)).all(axis=1)
        if not inside.any() and _encloses(pixels, size):
            return axis, half_angle + MORE
        half_angle *= 1.2
    return axis, np.pi


def _encloses(pixels: Floats, size: NDArray[np.int64]) -> bool:
    """Whether places of a picture lie on all sides of it."""
    known = pixels[np.isfinite(pixels).all(axis=1)]
    if len(known) < len(pixels):
        return False
    return bool((known.min(axis=0) < 0).all() and (known.max(axis=0) > size).all())
