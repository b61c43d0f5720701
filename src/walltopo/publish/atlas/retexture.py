"""New charts for a simplified surface, filled from the detailed mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.corners import shared_corners
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.geometry.neighbours import face_neighbours, patches
from walltopo.images.packing import fit_scale
from walltopo.publish.atlas.charts import choose_directions, label_triangles
from walltopo.publish.atlas.visible_faces import Axes, Sight
from walltopo.publish.surface import Look, Surface

Floats = NDArray[np.float64]
PAD = 2  # pixels of surroundings around each chart, for filtering
MOST_PICTURE = 60_000_000  # pixels of one drawing


def _drawing(
    detailed: Look,
    face: NDArray[np.int32],
    axes: Axes,
    low: Floats,
    scale: float,
    wanted: NDArray[np.bool_],
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """(H, W, 3) picture of the faces at (H, W) pixels where `wanted`, and which were drawn."""
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
    begin: Any, end: Any, drawn: Any, face: Any, faces: Any, flat: Any, uv: Any, wide: Any,
    tall: Any, where: Any,
) -> None:  # fmt: skip
    """Column and row of the picture that each drawn pixel's centre shows, kept in its face."""
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


def _filled(patch: NDArray[np.uint8], drawn: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """The patch with the nearest drawn colour where nothing was drawn."""
    from scipy.ndimage import distance_transform_edt

    if drawn.all():
        return patch
    if not drawn.any():
        return np.full_like(patch, 128)
    nearest = distance_transform_edt(~drawn, return_distances=False, return_indices=True)
    return np.asarray(patch[tuple(nearest)], dtype=np.uint8)


def _charts(surface: Surface) -> tuple[NDArray[np.int64], NDArray[np.int64], list[Axes]]:
    """Direction and chart of each triangle, and the directions."""
    mesh = surface.mesh
    axes = choose_directions(mesh.normals, mesh.areas)
    # Hold borders split vertices; charts go across them.
    places = _same_places(surface.positions)
    neighbours = face_neighbours(places[mesh.faces])
    label = label_triangles(mesh, axes, neighbours)
    return label, patches(neighbours, label)[0].astype(np.int64), axes


def _same_places(positions: NDArray[np.float32]) -> NDArray[np.int64]:
    """(V,) number of each vertex's place: those at one place have the same."""
    # Zero has two signs; by bits they would differ.
    bits = (positions + np.float32(0.0)).view(np.uint32).astype(np.uint64)
    _, number = np.unique((bits[:, 0] << np.uint64(32)) | bits[:, 1], return_inverse=True)
    key = (number.astype(np.uint64) << np.uint64(32)) | bits[:, 2]
    return np.asarray(np.unique(key, return_inverse=True)[1])


@dataclass(frozen=True, eq=False)
class _Layout:
    """Where each of n charts lies on the plane of its direction, and in the atlas.

    Parameters
    ----------
    direction : (n,) index of the direction.
    low : (n, 2) its rectangle's top-left corner on the plane, world units.
    scale : atlas pixels per world unit.
    sizes, places : (n, 2) atlas pixels of the rectangles with their padding.
    side : of the atlas, pixels.
    """

    direction: NDArray[np.int64]
    low: Floats
    side: int
    scale: float
    sizes: NDArray[np.int64]
    places: NDArray[np.int64]


def retexture(surface: Surface, detailed: Look, side: int, oversample: int = 1) -> Look:
    """Give a surface its own atlas.

    Parameters
    ----------
    surface : simplified; its own `uv` is ignored.
    detailed : the textured surface before simplification.
    side : of the new, square picture, pixels.
    oversample : draw that many times finer and average, for small pictures of fine textures.

    Returns
    -------
    The surface with vertices split at chart borders, and the (side, side, 3) picture.
    """
    import cv2

    label, chart, axes = _charts(surface)
    flat = np.empty((len(label), 3, 2))
    corner = surface.mesh.vertices[surface.mesh.faces]
    for k, way in enumerate(axes):
        flat[label == k] = way.flat(corner[label == k])
    count = int(chart.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, chart, flat.min(axis=1))
    np.maximum.at(high, chart, flat.max(axis=1))
    direction = np.zeros(count, dtype=np.int64)
    direction[chart] = label
    most = side / max(float((high - low).max()), 1e-9)
    scale, sizes, places = fit_scale(high - low, side, PAD, most)
    layout = _Layout(direction, low, side, scale, sizes, places)
    sight = Sight(detailed.surface.mesh, surface.mesh)
    picture = _filled_atlas(detailed, sight, label, axes, layout, oversample)
    if oversample > 1:
        picture = np.asarray(cv2.resize(picture, (side, side), interpolation=cv2.INTER_AREA))
    uv = ((flat - low[chart][:, None]) * scale + PAD + places[chart][:, None]) / side
    return Look(_split(surface, chart, uv.astype(np.float32)), picture.astype(np.uint8))


def _filled_atlas(
    detailed: Look,
    sight: Sight,
    label: NDArray[np.int64],
    axes: Sequence[Axes],
    layout: _Layout,
    oversample: int,
) -> NDArray[np.uint8]:
    """The atlas: of one drawing a direction, the rectangle of each chart."""
    fine, pad = layout.scale * oversample, PAD / layout.scale
    atlas = np.full((layout.side * oversample,) * 2 + (3,), 128, dtype=np.uint8)
    for k in np.unique(layout.direction).tolist():
        charts = np.flatnonzero(layout.direction == k)
        low, sizes = layout.low[charts], layout.sizes[charts]
        start = low.min(axis=0) - pad
        end = (low + sizes / layout.scale).max(axis=0)
        # Chart corners fall between the drawing's pixels: each is drawn to half a pixel.
        width, height = (int(v) + 2 for v in np.ceil((end - start) * fine))
        if width * height > MOST_PICTURE:
            raise ValueError(f"a drawing of {width}x{height} pixels is too large")
        corner = np.rint((low - pad - start) * fine).astype(int).clip(0)
        rectangles = np.hstack([corner, sizes * oversample]).tolist()
        wanted = np.zeros((height, width), dtype=bool)
        for x, y, w, h in rectangles:
            wanted[y : y + h, x : x + w] = True
        face = sight.faces_on(label == k, axes[k], start, fine, wanted)
        drawing, drawn = _drawing(detailed, face, axes[k], start, fine, wanted)
        for (x, y, w, h), place in zip(rectangles, layout.places[charts], strict=True):
            left, top = (place * oversample).tolist()
            part = np.s_[y : y + h, x : x + w]
            patch = _filled(drawing[part], drawn[part])
            atlas[top : top + patch.shape[0], left : left + patch.shape[1]] = patch
    return atlas


def _split(surface: Surface, chart: NDArray[np.int64], uv: NDArray[np.float32]) -> Surface:
    """One vertex a (vertex, chart)."""
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
