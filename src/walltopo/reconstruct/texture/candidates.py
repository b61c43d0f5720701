"""Choose the photo that paints each triangle: visibility, quality and smoothness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.core.parallel import map_ahead
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.topology import patches
from walltopo.geometry.zbuffer import faces_in_view, render_ids, submesh

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
# Returns the pixels of a photo that paint nothing, (H, W) bool, by the photo's name; None: no such.
Hidden = Callable[[str], NDArray[np.bool_] | None]

# Candidate photos stored per triangle; the limit bounds the memory for any number of photos.
CANDIDATES = 6
# Factor on the score of a triangle of which only the centroid is visible.
_PARTLY_VISIBLE = 0.02
# Rounds of smoothing of the normals before photos are compared by viewing angle.
_NORMAL_ROUNDS = 4
# Factor on a photo's frame when triangles outside it are culled, because of lens distortion.
_FRAME_SLACK = 1.25
# Standard deviation of the blur before triangle colours are sampled, pixels.
_BLUR = 1.5


@dataclass(frozen=True, eq=False)
class Candidates:
    """The best photos of each triangle, unordered.

    Parameters
    ----------
    view : (F, K) int16 index of the view, -1 = none.
    score : (F, K) float32, pixels per unit length times the cosine of the viewing angle, squared.
    colour : (F, K, 3) uint8 RGB at the triangle's centroid.
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
    """Insert one view into the candidates of the triangles `which` that it scores for, in place."""
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
        value = (focal * cosine / mz) ** 2 * (1.0 if whole else _PARTLY_VISIBLE)
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
    mesh: Mesh,
    views: Sequence[View],
    load: Callable[[str], Image],
    progress: Progress,
    hidden: Hidden | None = None,
) -> Candidates:
    """Return the best photos of every triangle, without occluded ones.

    Parameters
    ----------
    mesh : the surface, outward normals.
    views : cameras (with their distortion) and poses of the photos.
    load : returns the distorted photo of a name as (H, W, 3) uint8 RGB.
    progress : advanced once per view.
    hidden : returns the pixels of a photo that paint nothing; None: all may paint.
    """
    count = len(mesh.faces)
    view = np.full((count, CANDIDATES), -1, dtype=np.int16)
    score = np.zeros((count, CANDIDATES), dtype=np.float32)
    colour = np.zeros((count, CANDIDATES, 3), dtype=np.uint8)
    # Tolerance of the depth test: half an edge; more would paint a hold's colour onto the wall.
    tolerance = 0.5 * float(np.sqrt(np.median(mesh.areas) * 4.0 / np.sqrt(3.0)))
    normals = _smooth_normals(Mesh(mesh.vertices, mesh.faces))

    def drawn(item: View) -> _VisibleFaces | None:
        return _draw_view(mesh, normals, item, load, hidden)

    for index, faces_seen in enumerate(map_ahead(drawn, views)):
        if faces_seen is not None:
            in_ranges(
                _keep_best,
                len(faces_seen.which),
                index,
                views[index].camera.fx,
                *faces_seen,
                tolerance,
                view,
                score,
                colour,
            )
        progress.advance()
    return Candidates(view, score, colour)


class _VisibleFaces(NamedTuple):
    """The triangles in a view's frame, with the view's depth and colours (see `_keep_best`)."""

    which: NDArray[np.int64]
    pixels: NDArray[np.float32]
    z: NDArray[np.float32]
    near: NDArray[np.int32]
    cosines: NDArray[np.float32]
    nearest: NDArray[np.float32]
    depth: NDArray[np.float32]
    blurred: Image


def _draw_view(
    mesh: Mesh,
    normals: Floats,
    item: View,
    load: Callable[[str], Image],
    hidden: Hidden | None = None,
) -> _VisibleFaces | None:
    """Draw the mesh in one view; return None if no triangle lies in the frame."""
    which = faces_in_view(mesh, item.camera, item.cam_from_world)
    vertices, near = submesh(mesh, which)
    local = item.to_camera(vertices)
    framed = _may_be_in_photo(local, item)
    inside = framed[near].any(axis=1)
    which, near = which[inside], near[inside]
    if len(which) == 0:
        return None
    pixels = np.full((len(local), 2), -1.0, dtype=np.float32)
    pixels[framed] = np.nan_to_num(item.camera.project(local[framed]), nan=-1.0)
    _, depth = render_ids(vertices, near, item.camera, item.cam_from_world)
    mask = hidden(item.name) if hidden is not None else None
    if mask is not None:
        depth[mask] = 0.0  # as if something stood right before the camera
    # The minimum depth around each pixel: a triangle beside a nearer surface counts as partly
    # visible, so that the nearer surface's border does not bleed onto it.
    nearest = np.asarray(cv2.erode(depth, np.ones((3, 3), np.uint8)), dtype=np.float32)
    blurred = np.asarray(cv2.GaussianBlur(load(item.name), (0, 0), _BLUR), dtype=np.uint8)
    cosines = np.zeros(len(which), dtype=np.float32)
    centre = tuple(item.centre.tolist())
    in_ranges(_cosines, len(which), which, mesh.centroids, normals, centre, cosines)
    z = local[:, 2].astype(np.float32)
    return _VisibleFaces(which, pixels, z, near, cosines, nearest, depth, blurred)


def _smooth_normals(mesh: Mesh) -> Floats:
    """Return (F, 3) unit normals of the smoothed surface.

    A stereo mesh is rough. With unsmoothed normals, neighbours would prefer different photos, and
    every change of photo is a seam.
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


def _may_be_in_photo(local: Floats, view: View) -> NDArray[np.bool_]:
    """Return (V,) whether points of the camera frame may lie in the photo: a slightly wide cone."""
    camera = view.camera
    corner = np.array(
        [
            max(camera.cx, camera.width - camera.cx) / camera.fx,
            max(camera.cy, camera.height - camera.cy) / camera.fy,
        ]
    )
    reach = _FRAME_SLACK * float(np.linalg.norm(corner))
    x, y, z = local.T
    return (z > 0) & (x * x + y * y < (reach * z) ** 2)


@kernel
def _cosines(
    begin: Any, end: Any, which: Any, centroids: Any, normals: Any, centre: Any, cosines: Any
) -> None:
    """Fill the cosine of the angle between each triangle's normal and the ray to the camera."""
    for n in range(begin, end):
        f = which[n]
        x, y = centre[0] - centroids[f, 0], centre[1] - centroids[f, 1]
        z = centre[2] - centroids[f, 2]
        length = np.sqrt(x * x + y * y + z * z)
        along = x / length * normals[f, 0] + y / length * normals[f, 1] + z / length * normals[f, 2]
        cosines[n] = along


# Number of sweeps; the smoothness weight grows over them, so that good photos spread first.
_SWEEPS = 12
# Charts of fewer triangles take a neighbouring chart's photo, if that photo sees them.
_MIN_CHART = 200


@kernel
def _sweep(
    view: NDArray[np.int16],
    gain: NDArray[np.float32],
    adjacent: NDArray[np.int32],
    strength: float,
    label: NDArray[np.int16],
    forward: bool,
) -> int:
    """Give every triangle the candidate with the best score plus smoothness, in place."""
    changed = 0
    count = len(label)
    for step in range(count):
        f = step if forward else count - 1 - step
        best, best_value = label[f], -np.inf
        for k in range(view.shape[1]):
            if view[f, k] < 0:
                continue
            value = gain[f, k]
            for n in range(3):
                other = adjacent[f, n]
                if other >= 0 and label[other] == view[f, k]:
                    value += strength
            if value > best_value:
                best, best_value = view[f, k], value
        if best != label[f]:
            label[f] = best
            changed += 1
    return changed


def choose_labels(
    candidates: Candidates, adjacent: NDArray[np.int32], smoothness: float
) -> NDArray[np.int16]:
    """Return the (F,) int16 view of each triangle, -1 if no photo sees it.

    Iterated conditional modes maximise log(score) plus `smoothness` per equal neighbour: a local
    optimum of the energy of Lempitsky and Ivanov, "Seamless mosaicing of image-based texture
    maps", 2007.
    """
    view = candidates.view
    gain = np.log(np.maximum(candidates.score, 1e-6)).astype(np.float32)
    best = np.where(view >= 0, gain, -np.inf).argmax(axis=1)
    label = view[np.arange(len(view)), best].copy()
    for sweep in range(_SWEEPS):
        strength = smoothness * (sweep + 1) / _SWEEPS
        _sweep(view, gain, adjacent, strength, label, sweep % 2 == 0)
    _absorb_small(view, adjacent, label)
    return label


@kernel
def _relabel(
    view: NDArray[np.int16],
    adjacent: NDArray[np.int32],
    small: NDArray[np.bool_],
    label: NDArray[np.int16],
) -> None:
    """Give triangles of small charts the label of a neighbour outside, if that view sees them."""
    for f in range(len(label)):
        if not small[f]:
            continue
        for n in range(3):
            other = adjacent[f, n]
            if other < 0 or small[other] or label[other] == label[f]:
                continue
            for k in range(view.shape[1]):
                if view[f, k] >= 0 and view[f, k] == label[other]:
                    label[f] = label[other]
                    small[f] = False


def _absorb_small(
    view: NDArray[np.int16], adjacent: NDArray[np.int32], label: NDArray[np.int16]
) -> None:
    """Merge small charts into their neighbours, in place."""
    for _ in range(3):
        chart, _ = patches(adjacent, label)
        small = (np.bincount(chart) < _MIN_CHART)[chart] & (label >= 0)
        for _ in range(8):
            _relabel(view, adjacent, small, label)
