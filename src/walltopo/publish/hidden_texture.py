"""Replace hidden places in a texture by colours of the surface around them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.publish.texture_image import texels
from walltopo.scans.hidden import HiddenPlace, are_hidden

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SURROUNDINGS = 1.6  # radii around a place from which its colours come
_POINTS = 1000  # maximum number of points of the surroundings
_POWER = 3  # of the distance, by which a farther point counts less (Shepard 1968)
_ROWS = 4096  # vertices per step, to bound the memory
_INWARDS = 0.2  # from a corner to the triangle's middle, where the corner's colour is read
_MARGIN = 3.5  # texels around a triangle that belong to it too: a chart's gutter, and half a texel
_GREY = 128.0  # colour of a hidden place without surroundings
_MAX_TEXELS = 2_000_000  # per step, to bound the memory


def hide_in_texture(
    picture: NDArray[np.uint8],
    mesh: Mesh,
    uv: NDArray[np.float32],
    places: Sequence[HiddenPlace],
) -> NDArray[np.uint8]:
    """Return a copy of a texture in which nothing of hidden places is left.

    Parameters
    ----------
    picture : (H, W, 3) uint8 atlas.
    uv : (F, 3, 2) float32 in [0, 1], origin at the top left.
    """
    hidden = picture.copy()
    faces = _faces_near(mesh, places, 1.0)
    if not len(faces):
        return hidden
    colours = _vertex_colours(picture, mesh, uv, faces, places)
    size = np.array(picture.shape[1::-1])
    for rows, x, y in _texels_of(uv[faces] * size, size):
        share = _barycentric(uv[faces[rows]] * size, x, y)
        corners = mesh.faces[faces[rows]]
        inside = are_hidden(np.einsum("nk,nkd->nd", share, mesh.vertices[corners]), places)
        share, corners = share[inside].clip(0.0, 1.0), corners[inside]
        share /= share.sum(axis=1, keepdims=True)
        hidden[y[inside], x[inside]] = np.einsum("nk,nkd->nd", share, colours[corners]).round()
    return hidden


def _faces_near(mesh: Mesh, places: Sequence[HiddenPlace], radii: float) -> Ints:
    """Return (n,) the triangles that come within so many radii of a hidden place, and some more."""
    corners = mesh.vertices[mesh.faces] - mesh.centroids[:, None]
    reach = np.sqrt((corners**2).sum(axis=2).max(axis=1))
    near = np.zeros(len(mesh.faces), dtype=bool)
    for place in places:
        away = ((mesh.centroids - place.at) ** 2).sum(axis=1)
        near |= away <= (radii * place.radius_m + reach) ** 2
    return np.flatnonzero(near)


def _vertex_colours(
    picture: NDArray[np.uint8],
    mesh: Mesh,
    uv: NDArray[np.float32],
    faces: Ints,
    places: Sequence[HiddenPlace],
) -> Floats:
    """Return (V, 3) colours of the corners of `faces`; other rows are unused.

    Each is the weighted mean of points of the surroundings, nearer ones counting more.
    """
    from scipy.spatial.distance import cdist

    around = _faces_near(mesh, places, _SURROUNDINGS)
    inwards = uv[around] + _INWARDS * (uv[around].mean(axis=1, keepdims=True) - uv[around])
    corners = mesh.faces[around].ravel()
    visible = ~are_hidden(mesh.vertices[corners], places)
    colours = np.full(mesh.vertices.shape, _GREY)
    if not visible.any():
        return colours
    chosen = np.flatnonzero(visible)[:: max(1, int(visible.sum()) // _POINTS)]
    seen = texels(picture, inwards.reshape(-1, 2)[chosen]).astype(np.float64)
    points = mesh.vertices[corners[chosen]]
    wanted = np.unique(mesh.faces[faces])
    for rows in np.array_split(wanted, -(-len(wanted) // _ROWS)):
        weight = np.maximum(cdist(mesh.vertices[rows], points), 1e-9) ** -_POWER
        colours[rows] = weight @ seen / weight.sum(axis=1, keepdims=True)
    return colours


def _texels_of(triangles: Floats, size: Ints) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Yield the texels of (n, 3, 2) triangles in steps: their triangle, column and row; (t,) each.

    Texels up to `_MARGIN` outside a triangle are its own.
    """
    low = np.floor(triangles.min(axis=1) - _MARGIN).astype(np.int64).clip(0, size - 1)
    high = np.ceil(triangles.max(axis=1) + _MARGIN).astype(np.int64).clip(low + 1, size)
    wide, tall = (high - low).T
    step = np.cumsum(wide * tall) // _MAX_TEXELS
    for number in np.unique(step).tolist():
        rows = np.flatnonzero(step == number)
        count = (wide * tall)[rows]
        of_row = np.repeat(rows, count)
        place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        x = low[of_row, 0] + place % wide[of_row]
        y = low[of_row, 1] + place // wide[of_row]
        away = _distance_outside(triangles[of_row], x, y)
        own = away <= _MARGIN
        yield of_row[own], x[own], y[own]


def _barycentric(triangles: Floats, x: Ints, y: Ints) -> Floats:
    """Return (t, 3) shares of the corners of (t, 3, 2) triangles at the middles of texels.

    Corners of a triangle without area have equal shares.
    """
    a, b, c = triangles.swapaxes(0, 1)
    area = _cross(b - a, c - a)
    point = np.stack([x, y], axis=1) + 0.5
    shares = np.stack([_cross(b - point, c - point), _cross(c - point, a - point)], axis=1)
    flat = np.abs(area) < 1e-12
    shares = np.where(flat[:, None], 1 / 3, shares / np.where(flat, 1.0, area)[:, None])
    return np.column_stack([shares, 1 - shares.sum(axis=1)])


def _distance_outside(triangles: Floats, x: Ints, y: Ints) -> Floats:
    """Return (t,) the distances of the middles of texels from (t, 3, 2) triangles; <= 0 inside.

    Beyond a corner it is the larger distance from the lines of the sides.
    """
    point = np.stack([x, y], axis=1) + 0.5
    a, b, c = triangles.swapaxes(0, 1)
    turn = np.where(_cross(b - a, c - a) < 0, -1.0, 1.0)
    away = [
        -turn * _cross(end - start, point - start) / np.maximum(_length(end - start), 1e-9)
        for start, end in ((a, b), (b, c), (c, a))
    ]
    return np.max(away, axis=0)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _length(a: Floats) -> Floats:
    return np.asarray(np.hypot(a[:, 0], a[:, 1]))
