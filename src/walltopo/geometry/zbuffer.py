"""A z-buffer: which triangle each pixel of a photo sees, and how far away."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.screen import clip_near, screen_vertices
from walltopo.geometry.triangle_index import triangles_of_mesh

Floats = NDArray[np.float64]

BAND_ROWS = 32

CHUNK = 1 << 15


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
    deterministic. May be called from several threads.
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
    """Draw triangles whose vertices are on the screen already.

    Parameters
    ----------
    screen : (V, 3) x and y in pixels, and how near: above 0 and the larger the nearer, affine on
        the screen (1/z, or minus a distance along parallel rays); 0 = not to be drawn.
    triangles : (T, 3) int32.

    Returns
    -------
    (height, width) int32, the nearest triangle at each pixel's centre, -1 = none; and how near
    (height, width), 0 where none. As of `render_ids`.
    """
    face_id = np.full((height, width), -1, dtype=np.int32)
    near = np.zeros((height, width), dtype=np.float64)
    if len(triangles):
        bands = (height + BAND_ROWS - 1) // BAND_ROWS
        starts, order = _into_bands(screen, triangles, width, height, bands)
        # Few triangles are drawn sooner than threads are started.
        least = 1 if len(triangles) > CHUNK else bands
        in_ranges(_draw_bands, bands, screen, triangles, starts, order, face_id, near, least=least)
    return face_id, near


def _into_bands(
    screen: Floats, triangles: NDArray[np.int32], width: int, height: int, bands: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Triangle indices grouped by band, ascending within each: (bands + 1,) starts, indices."""
    count = len(triangles)
    chunks = (count + CHUNK - 1) // CHUNK
    first, last = np.zeros(count, dtype=np.int16), np.full(count, -1, dtype=np.int16)
    in_ranges(_band_range, count, screen, triangles, width, height, first, last, least=CHUNK)
    counts = np.zeros((chunks, bands), dtype=np.int64)
    in_ranges(_count_bands, chunks, first, last, counts)
    # Band after band, and in each band chunk after chunk.
    ends = np.cumsum(counts.T).reshape(bands, chunks).T
    starts = np.concatenate([[0], ends[-1]])
    order = np.zeros(starts[-1], dtype=np.int32)
    in_ranges(_fill_bands, chunks, first, last, np.ascontiguousarray(ends - counts), order)
    return starts, order


@kernel
def _band_range(begin, end, screen, triangles, width, height, first, last):  # type: ignore[no-untyped-def]
    """First and last band of each triangle; last < first for one that is not to be drawn."""
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
    """How many triangles of each chunk each band has: adds to (chunks, bands) `counts`."""
    for k in range(begin, end):
        for t in range(k * CHUNK, min(len(first), (k + 1) * CHUNK)):
            for band in range(first[t], last[t] + 1):
                counts[k, band] += 1


@kernel
def _fill_bands(begin, end, first, last, places, order):  # type: ignore[no-untyped-def]
    """Write each chunk's triangles to `order`, from each band's place for that chunk on."""
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
