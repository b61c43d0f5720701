"""Render a mesh with a z-buffer: the visible triangle and its depth at each pixel."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.rays import triangle_index_of
from walltopo.geometry.screen import clip_near, screen_vertices

Floats = NDArray[np.float64]

BAND_ROWS = 32  # image rows per unit of parallel work

CHUNK = 1 << 15  # triangles per unit of parallel work


def render_ids(
    vertices: Floats, faces: NDArray[np.int32], camera: Camera, cam_from_world: Floats
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Render a mesh as the camera sees it.

    Parameters
    ----------
    vertices : (V, 3) float, world frame, metres.
    faces : (F, 3) int32; both sides of a triangle are opaque.
    camera : intrinsics; distortion is applied at the vertices (edges between them stay straight).
        Triangles with a vertex outside the model's one-to-one range are not drawn.
    cam_from_world : (3, 4) float, world to camera frame (x right, y down, z forward).

    Returns
    -------
    face_id : (H, W) int32, face at each pixel's centre, -1 = none.
    depth : (H, W) float32, z in the camera frame, metres; inf without a face.

    Notes
    -----
    At equal depth the triangle with the lowest index wins, so the result is deterministic. The
    function is thread-safe.
    """
    faces = np.ascontiguousarray(faces, dtype=np.int32)
    local = np.ascontiguousarray(vertices, dtype=np.float64) @ cam_from_world[:, :3].T
    local += cam_from_world[:, 3]
    triangles, owner, local = clip_near(local, faces)
    screen = screen_vertices(local, camera)
    face_id, inverse = draw_screen(screen, triangles, camera.width, camera.height)
    if owner is not None:
        drawn = face_id >= 0
        face_id[drawn] = owner[face_id[drawn]]
    with np.errstate(divide="ignore"):
        depth = (1.0 / inverse).astype(np.float32)
    return face_id, depth


def draw_screen(
    screen: Floats, triangles: NDArray[np.int32], width: int, height: int
) -> tuple[NDArray[np.int32], Floats]:
    """Draw triangles whose vertices are already in pixels.

    Parameters
    ----------
    screen : (V, 3) x and y in pixels, and nearness > 0, affine in the image (1/z, or an offset
        minus the distance along parallel rays); 0 = do not draw.
    triangles : (T, 3) int32.

    Returns
    -------
    (height, width) int32, nearest triangle at each pixel's centre, -1 = none; and (height, width)
    nearness, 0 without a triangle.
    """
    face_id = np.full((height, width), -1, dtype=np.int32)
    near = np.zeros((height, width), dtype=np.float64)
    if len(triangles):
        bands = (height + BAND_ROWS - 1) // BAND_ROWS
        starts, order = _group_by_band(screen, triangles, width, height, bands)
        # Starting threads costs more than drawing few triangles.
        min_size = 1 if len(triangles) > CHUNK else bands
        in_ranges(
            _draw_bands, bands, screen, triangles, starts, order, face_id, near, min_size=min_size
        )
    return face_id, near


def _group_by_band(
    screen: Floats, triangles: NDArray[np.int32], width: int, height: int, bands: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Group triangle indices by band, ascending in each: (bands + 1,) starts, and indices."""
    count = len(triangles)
    chunks = (count + CHUNK - 1) // CHUNK
    first, last = np.zeros(count, dtype=np.int16), np.full(count, -1, dtype=np.int16)
    in_ranges(_band_range, count, screen, triangles, width, height, first, last, min_size=CHUNK)
    counts = np.zeros((chunks, bands), dtype=np.int64)
    in_ranges(_count_bands, chunks, first, last, counts)
    # Order by band, then by chunk.
    ends = np.cumsum(counts.T).reshape(bands, chunks).T
    starts = np.concatenate([[0], ends[-1]])
    order = np.zeros(starts[-1], dtype=np.int32)
    in_ranges(_fill_bands, chunks, first, last, np.ascontiguousarray(ends - counts), order)
    return starts, order


@kernel
def _band_range(begin, end, screen, triangles, width, height, first, last):  # type: ignore[no-untyped-def]
    """Fill the first and last band of each triangle; last < first for an invisible one."""
    for t in range(begin, end):
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


@kernel
def _count_bands(begin, end, first, last, counts):  # type: ignore[no-untyped-def]
    """Add the number of triangles per chunk and band to (chunks, bands) `counts`."""
    for k in range(begin, end):
        for t in range(k * CHUNK, min(len(first), (k + 1) * CHUNK)):
            for band in range(first[t], last[t] + 1):
                counts[k, band] += 1


@kernel
def _fill_bands(begin, end, first, last, places, order):  # type: ignore[no-untyped-def]
    """Write each chunk's triangles to `order`, starting at `places` (chunks, bands)."""
    for k in range(begin, end):
        for t in range(k * CHUNK, min(len(first), (k + 1) * CHUNK)):
            for band in range(first[t], last[t] + 1):
                order[places[k, band]] = t
                places[k, band] += 1


@kernel
def _draw_bands(begin, end, screen, triangles, starts, order, face_id, inverse):  # type: ignore[no-untyped-def]
    height = face_id.shape[0]
    for band in range(begin, end):
        top = band * BAND_ROWS
        bottom = min(height, top + BAND_ROWS)
        for k in range(starts[band], starts[band + 1]):
            t = order[k]
            _draw(screen, triangles[t], t, top, bottom, face_id, inverse)


@kernel
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


Ints = NDArray[np.int64]

_MAX_SHARE = 0.5  # share of the triangles in view above which culling does not pay

MAX_HALF_ANGLE = 1.2  # radians; a wider view is rendered from the whole mesh

MARGIN = 0.02  # radians added to the cone, because its surface is only sampled


def render_culled(
    mesh: Mesh, camera: Camera, cam_from_world: Floats
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Render the mesh as `render_ids` does, but only from the triangles in view if that is
    faster."""
    rows = faces_in_view(mesh, camera, cam_from_world)
    if len(rows) > _MAX_SHARE * len(mesh.faces):
        return render_ids(mesh.vertices, mesh.faces, camera, cam_from_world)
    vertices, faces = submesh(mesh, rows)
    face, depth = render_ids(vertices, faces, camera, cam_from_world)
    seen = face >= 0
    face[seen] = rows[face[seen]]
    return face, depth


def faces_in_view(mesh: Mesh, camera: Camera, cam_from_world: Floats) -> Ints:
    """Return (n,) ascending: a superset of the triangles that may lie in a picture.

    Parameters
    ----------
    cam_from_world : (3, 4).
    """
    axis, half_angle = view_cone(camera)
    rotation = cam_from_world[:, :3]
    centre = -rotation.T @ cam_from_world[:, 3]
    return triangle_index_of(mesh).in_cone(centre, axis @ rotation, half_angle)


def submesh(mesh: Mesh, rows: Ints) -> tuple[Floats, NDArray[np.int32]]:
    """Return the (V, 3) vertices of some triangles, by first use, and their (n, 3) int32 faces."""
    faces = mesh.faces[rows]
    # The system provides the zeros page by page, so vertices elsewhere in the mesh cost nothing.
    used = _number_vertices(faces, np.zeros(len(mesh.vertices), dtype=np.int32))
    return mesh.vertices[used], faces


@kernel
def _number_vertices(faces: Any, number: Any) -> Any:
    """Renumber vertices in (n, 3) faces by first use; return (V,) old numbers.

    `number` is a work space of zeros, one per old vertex.
    """
    corner = faces.ravel()
    used = np.empty(len(corner), dtype=np.int32)
    count = 0
    for k in range(len(corner)):
        vertex = corner[k]
        if number[vertex] == 0:
            used[count] = vertex
            count += 1
            number[vertex] = count
        corner[k] = number[vertex] - 1
    return used[:count].copy()


@lru_cache(maxsize=256)
def view_cone(camera: Camera) -> tuple[Floats, float]:
    """Return a cone that contains all rays of a picture.

    The cone is given by its unit axis (3,), camera frame, and its half angle, radians. It is
    widened until no ray on its surface projects into the picture, so it is valid for any lens.
    """
    size = np.array([camera.width, camera.height])
    middle = (size / 2 - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    axis = np.append(middle, 1.0)
    axis /= np.linalg.norm(axis)
    right = np.cross(axis, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    angle = np.arange(0, 2 * np.pi, np.pi / 16)
    directions = np.outer(np.cos(angle), right) + np.outer(np.sin(angle), np.cross(axis, right))
    half_angle = 0.02
    while half_angle < MAX_HALF_ANGLE:
        pixels = camera.project(axis + np.tan(half_angle) * directions)
        inside = ((pixels >= 0) & (pixels <= size)).all(axis=1)
        if not inside.any() and _encloses(pixels, size):
            return axis, half_angle + MARGIN
        half_angle *= 1.2
    return axis, np.pi


def _encloses(pixels: Floats, size: NDArray[np.int64]) -> bool:
    """Return whether pixels lie on all sides of a picture."""
    finite = pixels[np.isfinite(pixels).all(axis=1)]
    if len(finite) < len(pixels):
        return False
    return bool((finite.min(axis=0) < 0).all() and (finite.max(axis=0) > size).all())
