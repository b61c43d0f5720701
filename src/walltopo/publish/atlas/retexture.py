"""Make new charts for a simplified surface, and fill them from the detailed mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.topology import (
    bounds_by_group,
    face_neighbours,
    patches,
    shared_corners,
)
from walltopo.images.fill import fill_gaps
from walltopo.images.packing import fit_scale
from walltopo.publish.atlas.charts import choose_directions, label_triangles
from walltopo.publish.atlas.visible_faces import Axes, FaceRenderer
from walltopo.publish.surface import Surface, TexturedSurface, same_places

Floats = NDArray[np.float64]
PAD = 2  # pixels of surroundings around each chart, for texture filtering
MAX_PICTURE = 60_000_000  # pixels of one rendering


def _draw_direction(
    detailed: TexturedSurface,
    face: NDArray[np.int32],
    axes: Axes,
    low: Floats,
    scale: float,
    wanted: NDArray[np.bool_],
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return the (H, W, 3) picture of `face` at the `wanted` pixels, and the rendered pixels."""
    import cv2

    surface = detailed.surface
    assert surface.uv is not None
    assert detailed.picture is not None
    tall, wide = detailed.picture.shape[:2]
    flat = (axes.flat(surface.mesh.vertices) - low) * scale
    where = np.zeros((2, *wanted.shape), dtype=np.float32)
    drawn = wanted & (face >= 0)
    in_ranges(
        _look_up, len(wanted), drawn, face, surface.mesh.faces, flat, surface.uv, wide, tall, where
    )
    picture = cv2.remap(
        detailed.picture, where[0], where[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(picture, dtype=np.uint8), drawn


@kernel
def _look_up(
    begin: Any,
    end: Any,
    drawn: Any,
    face: Any,
    faces: Any,
    flat: Any,
    uv: Any,
    wide: Any,
    tall: Any,
    where: Any,
) -> None:
    """Find the texture column and row of each pixel's centre, clamped to its face."""
    for row in range(begin, end):
        for column in range(drawn.shape[1]):
            if not drawn[row, column]:
                continue
            f = face[row, column]
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            abx, aby = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
            acx, acy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
            apx, apy = column + 0.5 - flat[a, 0], row + 0.5 - flat[a, 1]
            area = abx * acy - aby * acx
            if not abs(area) > 1e-12:
                area = 1.0
            v, w = (apx * acy - apy * acx) / area, (abx * apy - aby * apx) / area
            u = min(max(1.0 - v - w, 0.0), 1.0)
            v, w = min(max(v, 0.0), 1.0), min(max(w, 0.0), 1.0)
            total = u + v + w
            u, v, w = u / total, v / total, w / total
            where[0, row, column] = (uv[a, 0] * u + uv[b, 0] * v + uv[c, 0] * w) * wide - 0.5
            where[1, row, column] = (uv[a, 1] * u + uv[b, 1] * v + uv[c, 1] * w) * tall - 0.5


def _choose_charts(surface: Surface) -> tuple[NDArray[np.int64], NDArray[np.int64], list[Axes]]:
    """Return direction and chart of each triangle, and the directions."""
    mesh = surface.mesh
    axes = choose_directions(mesh.normals, mesh.areas)
    # Hold borders split vertices; charts extend across them.
    places = same_places(surface.positions)
    neighbours = face_neighbours(places[mesh.faces])
    label = label_triangles(mesh, axes, neighbours)
    return label, patches(neighbours, label)[0].astype(np.int64), axes


@dataclass(frozen=True, eq=False)
class _Layout:
    """The position of each of n charts on the plane of its direction, and in the atlas.

    Parameters
    ----------
    direction : (n,) index of the direction.
    low : (n, 2) top-left corner of its rectangle on the plane, world units.
    scale : atlas pixels per world unit.
    sizes, places : (n, 2) atlas pixels of the rectangles with their padding.
    side : side of the atlas, pixels.
    """

    direction: NDArray[np.int64]
    low: Floats
    side: int
    scale: float
    sizes: NDArray[np.int64]
    places: NDArray[np.int64]


def retexture(
    surface: Surface, detailed: TexturedSurface, side: int, oversample: int = 1
) -> TexturedSurface:
    """Return a surface with its own atlas.

    Parameters
    ----------
    surface : the simplified surface; its own `uv` is ignored.
    detailed : the textured surface before simplification.
    side : side of the new, square picture, pixels.
    oversample : factor by which to render finer and average, for small pictures of fine textures.

    Returns
    -------
    The surface with vertices split at chart borders, and the (side, side, 3) picture.
    """
    import cv2

    label, chart, axes = _choose_charts(surface)
    flat = np.empty((len(label), 3, 2))
    corner = surface.mesh.vertices[surface.mesh.faces]
    for k, view in enumerate(axes):
        flat[label == k] = view.flat(corner[label == k])
    count = int(chart.max()) + 1
    low, high = bounds_by_group(chart, flat.swapaxes(0, 1), count)
    direction = np.zeros(count, dtype=np.int64)
    direction[chart] = label
    max_scale = side / max(float((high - low).max()), 1e-9)
    scale, sizes, places = fit_scale(high - low, side, PAD, max_scale)
    layout = _Layout(direction, low, side, scale, sizes, places)
    renderer = FaceRenderer(detailed.surface.mesh, surface.mesh)
    picture = _filled_atlas(detailed, renderer, label, axes, layout, oversample)
    if oversample > 1:
        picture = np.asarray(cv2.resize(picture, (side, side), interpolation=cv2.INTER_AREA))
    uv = ((flat - low[chart][:, None]) * scale + PAD + places[chart][:, None]) / side
    return TexturedSurface(
        _split_by_chart(surface, chart, uv.astype(np.float32)), picture.astype(np.uint8)
    )


def _filled_atlas(
    detailed: TexturedSurface,
    renderer: FaceRenderer,
    label: NDArray[np.int64],
    axes: Sequence[Axes],
    layout: _Layout,
    oversample: int,
) -> NDArray[np.uint8]:
    """Return the atlas: the rectangle of each chart, cut from one rendering per direction."""
    fine, pad = layout.scale * oversample, PAD / layout.scale
    atlas = np.full((layout.side * oversample,) * 2 + (3,), 128, dtype=np.uint8)
    for k in np.unique(layout.direction).tolist():
        charts = np.flatnonzero(layout.direction == k)
        low, sizes = layout.low[charts], layout.sizes[charts]
        start = low.min(axis=0) - pad
        end = (low + sizes / layout.scale).max(axis=0)
        # Chart corners fall between pixels, so charts are accurate to half a pixel.
        width, height = (int(v) + 2 for v in np.ceil((end - start) * fine))
        if width * height > MAX_PICTURE:
            raise ValueError(f"a rendering of {width}x{height} pixels is too large")
        corner = np.rint((low - pad - start) * fine).astype(int).clip(0)
        rectangles = np.hstack([corner, sizes * oversample]).tolist()
        wanted = np.zeros((height, width), dtype=bool)
        for x, y, w, h in rectangles:
            wanted[y : y + h, x : x + w] = True
        face = renderer.faces_on(label == k, axes[k], start, fine, wanted)
        drawing, drawn = _draw_direction(detailed, face, axes[k], start, fine, wanted)
        for (x, y, w, h), place in zip(rectangles, layout.places[charts], strict=True):
            left, top = (place * oversample).tolist()
            part = np.s_[y : y + h, x : x + w]
            if drawn[part].any():
                patch = fill_gaps(drawing[part], drawn[part])
                atlas[top : top + patch.shape[0], left : left + patch.shape[1]] = patch
    return atlas


def _split_by_chart(surface: Surface, chart: NDArray[np.int64], uv: NDArray[np.float32]) -> Surface:
    """Return the surface with one vertex per (vertex, chart)."""
    of_corner = np.broadcast_to(chart[:, None], surface.triangles.shape)
    first, triangles = shared_corners(surface.triangles, of_corner, len(surface.positions))
    source = surface.triangles.ravel()[first]
    return replace(
        surface,
        positions=surface.positions[source],
        triangles=triangles,
        feature=surface.feature[source],
        normals=surface.normals[source],
        uv=uv.reshape(-1, 2)[first],
        colours=None,
    )
