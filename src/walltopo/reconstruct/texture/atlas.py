"""Make the texture atlas of a mesh: choose photos, lay out charts, level colours, paint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError, View
from walltopo.core.parallel import map_ahead
from walltopo.geometry.topology import (
    bounds_by_group,
    face_neighbours,
    patches,
    shared_corners,
)
from walltopo.images.fill import fill_gaps
from walltopo.images.packing import fit_scale
from walltopo.reconstruct.settings import TextureSettings
from walltopo.reconstruct.texture.candidates import Hidden, choose_labels, find_candidates
from walltopo.reconstruct.texture.colour import level_seams, photo_gains
from walltopo.reconstruct.texture.consistency import leave_out_contradicted
from walltopo.reconstruct.texture.paint import paint_colours, paint_photo, sample_points
from walltopo.reconstruct.texture.unseen import (
    continue_colours,
    plane_positions,
    spread_colours,
    unseen_cells,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Image = NDArray[np.uint8]
Load = Callable[[str], Image]

_GUTTER = 3  # pixels by which a chart's colours extend beyond its border
_SMOOTHNESS = 1.0  # weight of large charts against the best photo per triangle

_TINY_CHART = 10  # charts of fewer triangles get one colour per triangle
# Minimum texels per photo pixel of a useful texture.
_MIN_SCALE = 0.05


@dataclass(frozen=True, eq=False)
class Texture:
    """The texture of a mesh.

    Parameters
    ----------
    image : (S, S, 3) uint8 RGB.
    uv : (F, 3, 2) float32 in [0, 1], origin at the image's top left.
    label : (F,) int16 index of the view that painted each triangle, -1 = none.
    charts : number of charts.
    scale : texels per photo pixel.
    """

    image: Image
    uv: NDArray[np.float32]
    label: NDArray[np.int16]
    charts: int
    scale: float


def make_texture(
    mesh: Mesh,
    views: Sequence[View],
    load: Load,
    settings: TextureSettings,
    progress: Progress,
    hidden: Hidden | None = None,
) -> Texture:
    """Paint the mesh from the photos.

    Parameters
    ----------
    mesh : the surface, outward normals.
    views : cameras (with their distortion) and poses of the photos.
    load : returns the distorted photo of a name as (H, W, 3) uint8 RGB.
    settings : see `TextureSettings`.
    progress : advances per photo.
    hidden : returns the pixels of a photo that paint nothing; None: all may paint.

    Raises
    ------
    StageError : no photo sees the mesh, or the charts do not fit the atlas.
    """
    label, chart, gains = _choose_photos(mesh, views, load, settings, progress, hidden)
    blank = (label < 0) & ~mesh.measured
    painted_from = _faces_by_label(label, len(views))
    pixels = _photo_positions(mesh, views, painted_from)
    # A tiny chart needs more texels for its border than for its triangles.
    tiny = (np.bincount(chart) < _TINY_CHART)[chart]
    flat = (label < 0) & ~blank | tiny
    continued = np.where(blank & ~tiny, chart, -1).astype(np.int32)
    pixels += plane_positions(mesh, continued, _pixels_per_unit(mesh, pixels))
    texels, charts, scale = _pack_charts(pixels, chart, flat, settings)
    progress.step("levelling colours", len(views))
    node, vertex = _corner_nodes(mesh.faces, chart, label)
    del chart
    colour = _node_colours(views, load, painted_from, pixels, node, len(vertex), gains, progress)
    shift = np.zeros_like(colour)
    if settings.blend:
        shift = level_seams(node[label >= 0], vertex, colour)
    progress.step("painting", len(views))
    atlas = np.zeros((settings.size, settings.size, 3), dtype=np.uint8)
    painted = np.zeros(atlas.shape[:2], dtype=np.uint8)

    def loaded(k: int) -> tuple[Ints, Image | None]:
        which = painted_from[k][~flat[painted_from[k]]]
        return which, load(views[k].name) if len(which) else None

    correction = shift.astype(np.float32)
    for gain, (which, photo) in zip(gains, map_ahead(loaded, range(len(views))), strict=True):
        if photo is not None:
            own = gain.astype(np.float32)
            paint_photo(photo, own, which, pixels, texels, node, correction, atlas, painted)
        progress.advance()
    del pixels, node, correction
    if flat.any():
        known = spread_colours(mesh.faces, len(mesh.vertices), vertex, colour + shift)
        paint_colours(np.flatnonzero(flat), texels, _corner_tint(mesh, flat, known), atlas, painted)
    continue_colours(mesh, continued, texels, atlas, painted)
    texels /= np.float32(settings.size)
    return Texture(fill_gaps(atlas, painted > 0), texels, label, charts, scale)


def _corner_tint(mesh: Mesh, flat: NDArray[np.bool_], known: Floats) -> NDArray[np.float32]:
    """Return the mean colour of the corners of each flat face."""
    return np.clip(known[mesh.faces[flat]].mean(axis=1), 0, 255).astype(np.float32)


def _choose_photos(
    mesh: Mesh,
    views: Sequence[View],
    load: Load,
    settings: TextureSettings,
    progress: Progress,
    hidden: Hidden | None,
) -> tuple[NDArray[np.int16], NDArray[np.int32], Floats]:
    """Return the view and the chart of each triangle (F,), and the gain of each photo (n, 3)."""
    progress.step("finding photos of each triangle", len(views))
    # The copy of the mesh is freed with all that it caches: a hall has millions of triangles.
    copy = Mesh(mesh.vertices, mesh.faces)
    candidates = find_candidates(copy, views, load, progress, hidden)
    del copy
    progress.step("choosing one photo per triangle")
    adjacent = face_neighbours(mesh.faces)
    gains = photo_gains(candidates, len(views))
    leave_out_contradicted(candidates, gains, adjacent)
    label = choose_labels(candidates, adjacent, _SMOOTHNESS)
    if not (label >= 0).any():
        raise StageError(
            "no photo sees any triangle of the mesh",
            "The mesh and the photos' poses are not in the same frame, or its normals point "
            "inwards: run `walltopo mesh check` on it.",
        )
    if not settings.blend:
        gains = np.ones_like(gains)
    chart, _ = patches(adjacent, np.where((label < 0) & ~mesh.measured, -2, label))
    return label, chart, gains


def _faces_by_label(label: NDArray[np.int16], count: int) -> list[NDArray[np.int64]]:
    """Return the triangles of each label from 0 to `count` - 1, ascending."""
    order = np.argsort(label, kind="stable")
    borders = np.searchsorted(label[order], np.arange(count + 1))
    return [order[a:b] for a, b in pairwise(borders)]


def _photo_positions(
    mesh: Mesh, views: Sequence[View], painted_from: Sequence[NDArray[np.int64]]
) -> NDArray[np.float32]:
    """Return (F, 3, 2) float32 pixels of the corners in the photo that paints each triangle."""
    pixels = np.zeros((len(mesh.faces), 3, 2), dtype=np.float32)
    for view, which in zip(views, painted_from, strict=True):
        pixels[which] = view.project(mesh.vertices[mesh.faces[which]])
    return pixels


def _pixels_per_unit(mesh: Mesh, pixels: NDArray[np.float32]) -> float:
    """Return the median number of photo pixels per world unit.

    Parameters
    ----------
    pixels : (F, 3, 2), zeros for triangles that no photo sees.
    """
    a, b = (pixels[:, k] - pixels[:, 0] for k in (1, 2))
    pixel_area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    is_seen = (pixel_area > 0) & (mesh.areas > 0)
    return float(np.sqrt(np.median(pixel_area[is_seen] / mesh.areas[is_seen])))


def _pack_charts(
    pixels: NDArray[np.float32],
    chart: NDArray[np.int32],
    flat: NDArray[np.bool_],
    settings: TextureSettings,
) -> tuple[NDArray[np.float32], int, float]:
    """Pack the charts; return the texels (F, 3, 2) float32, the number of charts and texels per
    pixel."""
    seen = np.flatnonzero(~flat)
    if len(seen) == 0:
        raise StageError(
            "the mesh consists of charts that are too small to texture", "Take more photos."
        )
    _, number = np.unique(chart[seen], return_inverse=True)
    count = int(number.max()) + 1
    low, high = bounds_by_group(number, (pixels[seen, corner] for corner in range(3)), count)
    cells, cell_side = unseen_cells(len(flat) - len(seen))
    scale, _, packed = fit_scale(high - low, settings.size, _GUTTER, 1.0, _MIN_SCALE, cell_side)
    place = packed + _GUTTER
    texels = np.zeros_like(pixels)
    shift = place[:count][number] - low[number] * scale
    texels[seen] = pixels[seen] * np.float32(scale) + shift[:, None, :].astype(np.float32)
    if cell_side:
        texels[flat] = cells + place[count].astype(np.float32)
    return texels, count, scale


def _corner_nodes(
    faces: NDArray[np.int32], chart: NDArray[np.int32], label: NDArray[np.int16]
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the (F, 3) node of each corner (-1 if unseen) and the (N,) vertex of each node.

    A node is a vertex in one chart; a vertex on a seam has several nodes.
    """
    seen = label >= 0
    some = faces[seen]
    charts = np.broadcast_to(chart[seen, None], some.shape)
    first, number = shared_corners(some, charts, int(some.max()) + 1)
    node = np.full(faces.shape, -1, dtype=np.int32)
    node[seen] = number
    return node, some.ravel()[first].astype(np.int64)


def _node_colours(
    views: Sequence[View],
    load: Load,
    painted_from: Sequence[NDArray[np.int64]],
    pixels: NDArray[np.float32],
    node: NDArray[np.int32],
    count: int,
    gains: Floats,
    progress: Progress,
) -> Floats:
    """Return the (N, 3) blurred colour of each node in its photo, times the photo's gain."""
    colour = np.zeros((count, 3))

    def sampled(k: int) -> tuple[NDArray[np.int32], Floats]:
        which = painted_from[k]
        if len(which) == 0:
            return np.zeros(0, dtype=np.int32), np.zeros((0, 3))
        nodes, first = np.unique(node[which].ravel(), return_index=True)
        points = pixels[which].reshape(-1, 2)[first]
        return nodes, sample_points(load(views[k].name), points) * gains[k]

    for nodes, found in map_ahead(sampled, range(len(views))):
        colour[nodes] = found
        progress.advance()
    return colour
