"""Extend the surrounding colours into triangles that no photo sees."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.graphs import symmetric_matrix
from walltopo.geometry.topology import faces_touching
from walltopo.reconstruct.texture.paint import paint_photo

Floats = NDArray[np.float64]

Image = NDArray[np.uint8]

Single = NDArray[np.float32]

Ints = NDArray[np.int64]

# Rings of triangles incidence a chart that its colours are extended from, and their margin, texels.
_RINGS = 2

_MARGIN = 12

# Radius of the inpainting, texels.
_INPAINT_RADIUS = 4

_WHITE = np.ones(3, dtype=np.float32)


def plane_positions(mesh: Mesh, chart: NDArray[np.int32], pixels_per_unit: float) -> Single:
    """Project charts onto their best-fitting planes; return (F, 3, 2) pixels, zeros elsewhere.

    Parameters
    ----------
    chart : (F,) chart of each face, -1 = none.
    pixels_per_unit : photo pixels per world unit.
    """
    result = np.zeros((len(mesh.faces), 3, 2), dtype=np.float32)
    own = np.flatnonzero(chart >= 0)
    part = Mesh(mesh.vertices, mesh.faces[own])
    for faces in _faces_by_chart(chart[own]):
        normal = part.areas[faces] @ part.normals[faces]
        # The last two right singular vectors of a normal span its plane.
        axes = np.linalg.svd(normal[None])[2][1:]
        result[own[faces]] = part.vertices[part.faces[faces]] @ axes.T * pixels_per_unit
    return result


def continue_colours(
    mesh: Mesh, chart: NDArray[np.int32], texels: Single, atlas: Image, painted: NDArray[np.uint8]
) -> None:
    """Paint charts of `plane_positions` by inpainting from their surroundings, in place.

    Parameters
    ----------
    chart : (F,) chart of each face, -1 = already painted.
    texels : (F, 3, 2) corners of all faces in the atlas.
    atlas, painted : (S, S, 3) and (S, S).
    """
    near = _faces_near(mesh, chart >= 0)
    incidence = _incidence_matrix(mesh.faces[near], len(mesh.vertices))
    incidence_t = incidence.T.tocsr()
    source = atlas.copy()
    for faces in _faces_by_chart(chart):
        ring = near[_faces_in_rings(incidence, incidence_t, np.searchsorted(near, faces))]
        ring = ring[chart[ring] < 0]
        low = np.floor(texels[faces].min(axis=(0, 1))) - _MARGIN
        width, height = (np.ceil(texels[faces].max(axis=(0, 1))) + _MARGIN - low).astype(int)
        place = np.zeros((len(faces) + len(ring), 3, 2), dtype=np.float32)
        place[: len(faces)] = texels[faces] - low
        place[len(faces) :] = _project_to_chart(mesh, faces, place[: len(faces)], ring)
        canvas = np.zeros((height, width, 3), dtype=np.uint8)
        known = np.zeros((height, width), dtype=np.uint8)
        own, ring_rows = np.arange(len(faces)), np.arange(len(faces), len(place))
        _copy_triangles(
            source, np.concatenate([texels[faces], texels[ring]]), ring_rows, place, canvas, known
        )
        for triangle in np.rint(place[own] - 0.5).astype(np.int32):
            cv2.fillConvexPoly(known, triangle, 0)
        if not known.any():
            # The ring projects onto the chart itself; use the mean colour of the ring.
            middle = np.rint(texels[ring].mean(axis=1) - 0.5).astype(int)
            canvas[:] = source[middle[:, 1], middle[:, 0]].mean(axis=0)
            known[:] = 1
        filled = np.asarray(
            cv2.inpaint(canvas, 1 - known, _INPAINT_RADIUS, cv2.INPAINT_TELEA), np.uint8
        )
        _copy_triangles(filled, place, own, texels[faces], atlas, painted)


def _faces_by_chart(chart: NDArray[np.int32]) -> list[Ints]:
    """Return the faces of each chart."""
    own = np.flatnonzero(chart >= 0)
    own = own[np.argsort(chart[own], kind="stable")]
    return np.split(own, np.flatnonzero(np.diff(chart[own])) + 1) if len(own) else []


def _faces_near(mesh: Mesh, chosen: NDArray[np.bool_]) -> Ints:
    """Return the chosen faces and those within the vertex rings around them."""
    for _ in range(_RINGS):
        chosen = faces_touching(mesh, chosen)
    return np.flatnonzero(chosen)


def _incidence_matrix(faces: NDArray[np.int32], vertices: int) -> Any:
    """Return the sparse (F, vertices) incidence matrix of faces and vertices."""
    from scipy.sparse import csr_matrix

    starts = np.arange(0, faces.size + 1, 3)
    ones = np.ones(faces.size, dtype=np.int32)
    return csr_matrix((ones, faces.ravel(), starts), shape=(len(faces), vertices))


def _faces_in_rings(incidence: Any, incidence_t: Any, faces: Ints) -> Ints:
    """Return the faces within some vertex rings around the given faces, including these.

    Parameters
    ----------
    incidence, incidence_t : result of `_incidence_matrix`, and its transpose.
    """
    found = faces
    for _ in range(_RINGS):
        vertices = np.unique(incidence[found].indices)
        found = np.unique(incidence_t[vertices].indices).astype(np.int64)
    return found


def _project_to_chart(mesh: Mesh, faces: Ints, place: Single, others: Ints) -> Single:
    """Map other faces into a chart's plane by extending the chart's linear map; return (n, 3,
    2)."""
    points = mesh.vertices[mesh.faces[faces]].reshape(-1, 3)
    target = place.reshape(-1, 2).astype(np.float64)
    middle, centre = points.mean(axis=0), target.mean(axis=0)
    # For a flat chart, the least-norm map projects along the normal.
    linear = np.linalg.lstsq(points - middle, target - centre, rcond=1e-6)[0]
    corners = mesh.vertices[mesh.faces[others]] - middle
    return np.asarray(corners @ linear + centre, dtype=np.float32)


def _copy_triangles(
    photo: Image,
    pixels: Single,
    which: Ints,
    texels: Single,
    canvas: Image,
    painted: NDArray[np.uint8],
) -> None:
    """Paint triangles `which` of one image into another, without colour changes."""
    node, plain = np.zeros((len(pixels), 3), dtype=np.int32), np.zeros((1, 3), dtype=np.float32)
    paint_photo(photo, _WHITE, which, pixels, texels, node, plain, canvas, painted)


_CELL = 2


def unseen_cells(count: int) -> tuple[NDArray[np.float32], int]:
    """Return (count, 3, 2) corners of triangles packed in a square of cells, and the square's
    side."""
    columns = int(np.ceil(np.sqrt(count)))
    index = np.arange(count)
    if count == 0:
        return np.zeros((0, 3, 2), dtype=np.float32), 0
    corner = np.stack([index % columns, index // columns], axis=1).astype(np.float32) * _CELL
    triangle = np.array([[0.75, 0.75], [1.25, 0.75], [0.75, 1.25]], dtype=np.float32)
    return corner[:, None, :] + triangle, columns * _CELL


def spread_colours(
    faces: NDArray[np.int32],
    vertex_count: int,
    known_vertex: NDArray[np.int64],
    known_colour: Floats,
) -> Floats:
    """Return (V, 3) colours; unknown vertices get the mean of known neighbours, ring by ring.

    Parameters
    ----------
    faces : (F, 3).
    vertex_count : V.
    known_vertex, known_colour : (N,) and (N, 3); a repeated vertex gets the mean. Components
        without a known colour get the mean of all.
    """
    total = np.zeros((vertex_count, 3))
    number = np.zeros(vertex_count)
    np.add.at(total, known_vertex, known_colour)
    np.add.at(number, known_vertex, 1.0)
    colour = total / np.maximum(number, 1.0)[:, None]
    known = number > 0
    # Only the edges of unknown vertices count.
    around = faces[~known[faces].all(axis=1)]
    i, j = around.ravel(), np.roll(around, -1, axis=1).ravel()
    graph = symmetric_matrix(vertex_count, i, j, np.ones(len(i), dtype=np.float32))
    while True:
        unknown = np.flatnonzero(~known)
        if len(unknown) == 0:
            return colour
        rows = graph[unknown]
        votes = rows @ known.astype(np.float64)
        reached = votes > 0
        if not reached.any():
            colour[unknown] = known_colour.mean(axis=0)
            return colour
        weighted = rows[reached] @ np.where(known[:, None], colour, 0.0)
        colour[unknown[reached]] = weighted / votes[reached, None]
        known[unknown[reached]] = True
