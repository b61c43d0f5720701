"""Which photos see each triangle, how well, and in which colour."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.core.parallel import ahead
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.zbuffer import faces_before, own_vertices, render_ids

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

# Photos remembered per triangle: the best few bound the memory at any number of photos.
CANDIDATES = 6
# A triangle of which only the middle is seen counts this share of one wholly seen.
_PARTLY_SEEN = 0.02
# Rounds of averaging over neighbours that the normals get before photos are compared by angle.
_NORMAL_ROUNDS = 4
# A photo's frame is taken this much larger when triangles are sorted out, for its distortion.
_FRAME_SLACK = 1.25
# Colours of triangles are read from photos blurred by this many pixels.
_BLUR = 1.5


@dataclass(frozen=True, eq=False)
class Candidates:
    """The best photos of each triangle, in no order.

    Parameters
    ----------
    view : (F, K) int16 index of the view, -1 = none.
    score : (F, K) float32, pixels per unit length times the cosine of the viewing angle, squared.
    colour : (F, K, 3) uint8 RGB at the triangle's middle.
    """

    view: NDArray[np.int16]
    score: NDArray[np.float32]
    colour: NDArray[np.uint8]


@kernel
def _keep_best(
    begin: int,
    end: int,
    index: int,
    focal: float,
    which: NDArray[np.int64],
    pixels: NDArray[np.float32],
    z: NDArray[np.float32],
    near: NDArray[np.int32],
    cosines: NDArray[np.float32],
    nearest: NDArray[np.float32],
    depth: NDArray[np.float32],
    blurred: Image,
    tolerance: float,
    view: NDArray[np.int16],
    score: NDArray[np.float32],
    colour: NDArray[np.uint8],
) -> None:
    """Offer one view to the triangles `which`, with their corners `near` and cosines (in place)."""
    height, width = depth.shape
    slots = view.shape[1]
    for n in range(begin, end):
        f = which[n]
        cosine = cosines[n]
        if cosine <= 0.05:
            continue
        inside = True
        whole = True
        mx = my = mz = 0.0
        slack = tolerance / cosine
        for corner in range(3):
            v = near[n, corner]
            x, y = pixels[v, 0], pixels[v, 1]
            if not (x >= 2.0 and y >= 2.0 and x < width - 2.0 and y < height - 2.0):
                inside = False
                break
            if z[v] > nearest[int(y), int(x)] + slack:
                whole = False
            mx += x / 3.0
            my += y / 3.0
            mz += z[v] / 3.0
        if not inside or mz > depth[int(my), int(mx)] + slack:
            continue
        value = (focal * cosine / mz) ** 2 * (1.0 if whole else _PARTLY_SEEN)
        worst = 0
        for k in range(1, slots):
            if score[f, k] < score[f, worst]:
                worst = k
        if value > score[f, worst]:
            score[f, worst] = value
            view[f, worst] = index
            for channel in range(3):
                colour[f, worst, channel] = blurred[int(my), int(mx), channel]


def find_candidates(
    mesh: Mesh, views: Sequence[View], load: Callable[[str], Image], progress: Progress
) -> Candidates:
    """The best photos of every triangle, occluded ones left out.

    Parameters
    ----------
    mesh : the surface, outward normals.
    views : cameras (with their distortion) and poses of the photos.
    load : gives a photo by name as (H, W, 3) uint8 RGB, as taken.
    progress : advanced once per view.
    """
    count = len(mesh.faces)
    view = np.full((count, CANDIDATES), -1, dtype=np.int16)
    score = np.zeros((count, CANDIDATES), dtype=np.float32)
    colour = np.zeros((count, CANDIDATES, 3), dtype=np.uint8)
    # Depth tests tolerate half an edge: more would let a hold's colour run onto the wall.
    tolerance = 0.5 * float(np.sqrt(np.median(mesh.areas) * 4.0 / np.sqrt(3.0)))
    normals = _smooth_normals(mesh)

    def looked(item: View) -> _Look | None:
        return _look(mesh, normals, item, load)

    for index, look in enumerate(ahead(looked, views)):
        if look is not None:
            in_ranges(
                _keep_best, len(look.which), index, views[index].camera.fx, *look, tolerance, view,
                score, colour,
            )  # fmt: skip
        progress.advance()
    return Candidates(view, score, colour)


class _Look(NamedTuple):
    """What one view offers to the triangles before it: see `_keep_best`."""

    which: NDArray[np.int64]
    pixels: NDArray[np.float32]
    z: NDArray[np.float32]
    near: NDArray[np.int32]
    cosines: NDArray[np.float32]
    nearest: NDArray[np.float32]
    depth: NDArray[np.float32]
    blurred: Image


def _look(mesh: Mesh, normals: Floats, item: View, load: Callable[[str], Image]) -> _Look | None:
    """Draw the mesh as one view sees it; None where that shows nothing of it."""
    which = faces_before(mesh, item.camera, item.cam_from_world)
    vertices, near = own_vertices(mesh, which)
    local = item.to_camera(vertices)
    framed = _framed(local, item)
    inside = framed[near].any(axis=1)
    which, near = which[inside], near[inside]
    if len(which) == 0:
        return None
    pixels = np.full((len(local), 2), -1.0, dtype=np.float32)
    pixels[framed] = np.nan_to_num(item.camera.project(local[framed]), nan=-1.0)
    _, depth = render_ids(vertices, near, item.camera, item.cam_from_world)
    # The smallest depth around each pixel: a triangle beside something nearer is not wholly
    # seen, so that the nearer thing's border does not bleed onto it.
    nearest = np.asarray(cv2.erode(depth, np.ones((3, 3), np.uint8)), dtype=np.float32)
    blurred = np.asarray(cv2.GaussianBlur(load(item.name), (0, 0), _BLUR), dtype=np.uint8)
    cosines = np.zeros(len(which), dtype=np.float32)
    centre = tuple(item.centre.tolist())
    in_ranges(_cosines, len(which), which, mesh.centroids, normals, centre, cosines)
    z = local[:, 2].astype(np.float32)
    return _Look(which, pixels, z, near, cosines, nearest, depth, blurred)


def _smooth_normals(mesh: Mesh) -> Floats:
    """(F, 3) unit normals of the surface without its finest relief.

    A mesh from stereo is a little rough; with each triangle's own normal, neighbours would
    prefer different photos and every preference would be a seam.
    """
    from scipy.sparse import csr_matrix

    count = len(mesh.faces)
    ones = np.ones(3 * count, dtype=np.float32)
    shape = (count, len(mesh.vertices))
    corner = csr_matrix((ones, mesh.faces.ravel(), np.arange(0, 3 * count + 1, 3)), shape=shape)
    normals = mesh.normals * mesh.areas[:, None]
    for _ in range(_NORMAL_ROUNDS):
        normals = corner @ (corner.T @ normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return normals


def _framed(local: Floats, view: View) -> NDArray[np.bool_]:
    """(V,) whether points of the camera frame may lie in the photo: a cone, a little too wide."""
    camera = view.camera
    corner = np.array([max(camera.cx, camera.width - camera.cx) / camera.fx,
                       max(camera.cy, camera.height - camera.cy) / camera.fy])  # fmt: skip
    reach = _FRAME_SLACK * float(np.linalg.norm(corner))
    x, y, z = local.T
    return (z > 0) & (x * x + y * y < (reach * z) ** 2)


@kernel
def _cosines(
    begin: Any, end: Any, which: Any, centroids: Any, normals: Any, centre: Any, cosines: Any
) -> None:
    """Cosine of the angle between each triangle's normal and the ray to the camera (in place)."""
    for n in range(begin, end):
        f = which[n]
        x, y = centre[0] - centroids[f, 0], centre[1] - centroids[f, 1]
        z = centre[2] - centroids[f, 2]
        length = np.sqrt(x * x + y * y + z * z)
        along = x / length * normals[f, 0] + y / length * normals[f, 1] + z / length * normals[f, 2]
        cosines[n] = along
