"""A z-buffer: which triangle each pixel of a photo sees, and how far away.

Triangles are sorted into bands of pixel rows, the bands are drawn in parallel, each band in the
order of the triangles: the picture does not depend on the number of threads.
"""

from __future__ import annotations

import threading

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.raycast.clip import clip_near
from walltopo.raycast.screen import screen_vertices

__all__ = ["render_ids"]

Floats = NDArray[np.float64]
BAND_ROWS = 32
CHUNK = 1 << 15
# Else numba's default threading layer ends the process.
_ONE_AT_A_TIME = threading.Lock()


def render_ids(
    vertices: Floats, faces: NDArray[np.int32], camera: Camera, cam_from_world: Floats
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Draw a mesh as the camera sees it.

    Parameters
    ----------
    vertices : (V, 3) float, world frame, metres.
    faces : (F, 3) int32; both sides of a triangle are opaque.
    camera : intrinsics; distortion is honoured at the vertices (edges stay straight between
        them), and vertices outside the range where the model is one-to-one are not drawn.
    cam_from_world : (3, 4) float, world to camera frame (x right, y down, z forward).

    Returns
    -------
    face_id : (H, W) int32, the face at each pixel's centre, -1 = none.
    depth : (H, W) float32, its z in the camera frame, metres; inf where none.

    Notes
    -----
    Of several triangles at exactly the same depth the one with the lowest index wins;
    deterministic. May be called from several threads: numba's threads serve one at a time.
    """
    faces = np.ascontiguousarray(faces, dtype=np.int32)
    local = np.ascontiguousarray(vertices, dtype=np.float64) @ cam_from_world[:, :3].T
    local += cam_from_world[:, 3]
    triangles, owner, local = clip_near(local, faces)
    screen = screen_vertices(local, camera)
    face_id = np.full((camera.height, camera.width), -1, dtype=np.int32)
    inverse = np.zeros((camera.height, camera.width), dtype=np.float64)
    if len(triangles):
        bands = (camera.height + BAND_ROWS - 1) // BAND_ROWS
        with _ONE_AT_A_TIME:
            first, last = _band_range(screen, triangles, camera.width, camera.height)
            starts, order = _sort_into_bands(first, last, bands)
            _draw_bands(screen, triangles, starts, order, face_id, inverse)
        if owner is not None:
            drawn = face_id >= 0
            face_id[drawn] = owner[face_id[drawn]]
    with np.errstate(divide="ignore"):
        depth = (1.0 / inverse).astype(np.float32)
    return face_id, depth


@njit(parallel=True, cache=True)
def _band_range(screen, triangles, width, height):  # type: ignore[no-untyped-def]
    """First and last band of each triangle; last < first for one that is not to be drawn."""
    n = len(triangles)
    first = np.zeros(n, dtype=np.int16)
    last = np.full(n, -1, dtype=np.int16)
    for t in prange(n):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x0 = min(screen[a, 0], screen[b, 0], screen[c, 0])
        x1 = max(screen[a, 0], screen[b, 0], screen[c, 0])
        y0 = min(screen[a, 1], screen[b, 1], screen[c, 1])
        y1 = max(screen[a, 1], screen[b, 1], screen[c, 1])
        whole = screen[a, 2] > 0 and screen[b, 2] > 0 and screen[c, 2] > 0
        # A pixel's centre is at +0.5: the first centre at or right of x is ceil(x - 0.5).
        if whole and x1 >= 0.5 and y1 >= 0.5 and x0 <= width - 0.5 and y0 <= height - 0.5:
            top = int(np.ceil(max(y0, 0.5) - 0.5))
            bottom = int(np.floor(min(y1, height - 0.5) - 0.5))
            left = int(np.ceil(max(x0, 0.5) - 0.5))
            right = int(np.floor(min(x1, width - 0.5) - 0.5))
            if top <= bottom and left <= right:
                first[t] = top // BAND_ROWS
                last[t] = bottom // BAND_ROWS
    return first, last


@njit(parallel=True, cache=True)
def _sort_into_bands(first, last, bands):  # type: ignore[no-untyped-def]
    """Triangle indices grouped by band, ascending within each: (bands + 1) starts, indices."""
    n = len(first)
    chunks = (n + CHUNK - 1) // CHUNK
    counts = np.zeros((chunks, bands), dtype=np.int64)
    for k in prange(chunks):
        for t in range(k * CHUNK, min(n, (k + 1) * CHUNK)):
            for band in range(first[t], last[t] + 1):
                counts[k, band] += 1
    starts = np.zeros(bands + 1, dtype=np.int64)
    total = 0
    for band in range(bands):
        starts[band] = total
        for k in range(chunks):
            count = counts[k, band]
            counts[k, band] = total
            total += count
    starts[bands] = total
    order = np.zeros(total, dtype=np.int32)
    for k in prange(chunks):
        for t in range(k * CHUNK, min(n, (k + 1) * CHUNK)):
            for band in range(first[t], last[t] + 1):
                order[counts[k, band]] = t
                counts[k, band] += 1
    return starts, order


@njit(parallel=True, cache=True)
def _draw_bands(screen, triangles, starts, order, face_id, inverse):  # type: ignore[no-untyped-def]
    height = face_id.shape[0]
    for band in prange(len(starts) - 1):
        top = band * BAND_ROWS
        bottom = min(height, top + BAND_ROWS)
        for k in range(starts[band], starts[band + 1]):
            t = order[k]
            _draw(screen, triangles[t], t, top, bottom, face_id, inverse)


@njit(cache=True, inline="always")
def _draw(screen, triangle, index, top, bottom, face_id, inverse):  # type: ignore[no-untyped-def]
    """Draw one triangle into rows top..bottom-1; nearer (larger 1/z) wins, then lower index."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    ax, ay, bx, by = screen[a, 0], screen[a, 1], screen[b, 0], screen[b, 1]
    cx, cy = screen[c, 0], screen[c, 1]
    twice_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if twice_area == 0.0:
        return
    # Barycentric weights of b and c, and 1/z, are affine functions of the pixel.
    bu, bv = (cy - ay) / twice_area, (ax - cx) / twice_area
    cu, cv = (ay - by) / twice_area, (bx - ax) / twice_area
    az, bz, cz = screen[a, 2], screen[b, 2] - screen[a, 2], screen[c, 2] - screen[a, 2]
    row0 = max(top, int(np.ceil(max(min(ay, by, cy), 0.5) - 0.5)))
    row1 = min(bottom - 1, int(np.floor(min(max(ay, by, cy), bottom + 0.5) - 0.5)))
    width = face_id.shape[1]
    col0 = int(np.ceil(max(min(ax, bx, cx), 0.5) - 0.5))
    col1 = int(np.floor(min(max(ax, bx, cx), width - 0.5) - 0.5))
    for row in range(row0, row1 + 1):
        dy = row + 0.5 - ay
        for col in range(col0, col1 + 1):
            dx = col + 0.5 - ax
            wb = bu * dx + bv * dy
            wc = cu * dx + cv * dy
            if wb >= 0.0 and wc >= 0.0 and wb + wc <= 1.0:
                near = az + wb * bz + wc * cz
                if near > inverse[row, col]:
                    inverse[row, col] = near
                    face_id[row, col] = index
