"""Join the kept part of an old wall with the new part: one mesh, one texture atlas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.graphs import linked_components
from walltopo.geometry.topology import bounds_by_group, joined_meshes, part_of_mesh
from walltopo.images.packing import fit_scale, pack_rows

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Image = NDArray[np.uint8]

GUTTER: Final = 4  # pixels copied around each chart, for smaller copies of the picture
MAX_SIDE: Final = 16384
_MIN_SCALE: Final = 0.05
_STEP: Final = 256  # pixels
_SAME_UV: Final = 1 << 20  # steps of a texture coordinate that count as one


@dataclass(frozen=True, eq=False)
class Part:
    """The chosen triangles of one scan.

    Parameters
    ----------
    mesh : of the scan; chosen : (F,) bool.
    uv : (F, 3, 2) float32 in [0, 1], origin at the top left; image : (H, W, 3) uint8 sRGB.
    """

    mesh: Mesh
    chosen: Flags
    uv: NDArray[np.float32]
    image: Image


def join_meshes(parts: tuple[Part, Part]) -> Mesh:
    """Return the chosen triangles of both parts as one mesh, in their order."""
    return joined_meshes([part_of_mesh(part.mesh, part.chosen) for part in parts])


def join_textures(parts: tuple[Part, Part]) -> tuple[Image, NDArray[np.float32]]:
    """Return one atlas of the charts that the chosen triangles use, and their (F, 3, 2) uv.

    Charts keep their pixels as long as all fit into `MAX_SIDE`; the atlas does not grow with the
    number of rescans, because charts of replaced triangles are left out.
    """
    boxes = [_chart_boxes(part) for part in parts]
    corners = np.vstack([box.corners for box in boxes])
    extents = (corners[:, 1] - corners[:, 0]).astype(np.float64)
    side = _side_for(extents)
    # Above `MAX_SIDE` the charts are reduced.
    scale, _, packed = fit_scale(extents, side, GUTTER, 1.0, _MIN_SCALE)
    places = packed + GUTTER
    atlas = np.full((side, side, 3), 128, dtype=np.uint8)
    uv, first = [], 0
    for part, box in zip(parts, boxes, strict=True):
        own = places[first : first + len(box.corners)]
        first += len(box.corners)
        for (low, high), place in zip(box.corners, own, strict=True):
            _copy_chart(part.image, low, high, atlas, place, scale)
        size = np.array(part.image.shape[1::-1], dtype=np.float64)
        texels = part.uv[part.chosen] * size - box.corners[box.chart, 0][:, None]
        uv.append((texels * scale + own[box.chart][:, None]) / side)
    return atlas, np.vstack(uv).astype(np.float32)


@dataclass(frozen=True, eq=False)
class _Boxes:
    """The charts of a part: `chart` (f,) of each chosen triangle; `corners` (n, 2, 2) int, left
    top (included) and right bottom (excluded) in pixels."""

    chart: NDArray[np.int32]
    corners: NDArray[np.int64]


def _chart_boxes(part: Part) -> _Boxes:
    """Return the charts: triangles connected by vertices with the same place in the picture."""
    faces, uv = part.mesh.faces[part.chosen], part.uv[part.chosen]
    place = np.round(uv.astype(np.float64) * _SAME_UV).astype(np.int64)
    keys = np.column_stack([faces.ravel(), place.reshape(-1, 2)])
    _, node = np.unique(keys, axis=0, return_inverse=True)
    node = node.reshape(-1, 3).astype(np.int64)
    count = int(node.max(initial=-1)) + 1
    group = linked_components(count, node[:, [0, 1]].ravel(), node[:, [1, 2]].ravel())
    _, chart = np.unique(group[node[:, 0]], return_inverse=True)
    size = np.array(part.image.shape[1::-1], dtype=np.float64)
    pixels, charts = uv * size, int(chart.max(initial=-1)) + 1
    low, high = bounds_by_group(chart, pixels.swapaxes(0, 1), charts)
    bounds = np.stack([np.floor(low), np.ceil(high) + 1], axis=1)
    return _Boxes(chart.astype(np.int32), bounds.astype(np.int64))


def _side_for(extents: Floats) -> int:
    """Return the side of the smallest square for the padded rectangles, a multiple of 256."""
    padded = (np.ceil(extents) + 1 + 2 * GUTTER).astype(np.int64)
    least = max(np.sqrt(padded.prod(axis=1).sum()), float(padded.max(initial=1)))
    side = int(np.ceil(least / _STEP) * _STEP)
    while side < MAX_SIDE and pack_rows(padded, side)[1] > side:
        side += _STEP
    return min(side, MAX_SIDE)


def _copy_chart(
    source: Image,
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    atlas: Image,
    place: NDArray[np.int64],
    scale: float,
) -> None:
    """Copy a chart with its gutter; beyond the source's border its last pixels are repeated."""
    import cv2

    height, width = source.shape[:2]
    extent = np.ceil((high - low) * scale).astype(np.int64) + 1
    x = np.arange(-GUTTER, extent[0] + GUTTER)
    y = np.arange(-GUTTER, extent[1] + GUTTER)
    if scale == 1.0:
        columns, rows = np.clip(x + low[0], 0, width - 1), np.clip(y + low[1], 0, height - 1)
        picture = source[rows[:, None], columns[None]]
    else:
        grid_x = np.broadcast_to((x + 0.5) / scale + low[0] - 0.5, (len(y), len(x)))
        grid_y = np.broadcast_to(((y + 0.5) / scale + low[1] - 0.5)[:, None], (len(y), len(x)))
        picture = cv2.remap(
            source,
            grid_x.astype(np.float32),
            grid_y.astype(np.float32),
            cv2.INTER_AREA,
            borderMode=cv2.BORDER_REPLICATE,
        )
    left, top = place - GUTTER
    atlas[top : top + len(y), left : left + len(x)] = picture
