"""Paint the atlas: every triangle's texels from its photo."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import in_ranges, kernel

Image = NDArray[np.uint8]
Single = NDArray[np.float32]

_BAND = 64  # rows of the atlas per unit of parallel work


@kernel
def _sample(photo: Image, x: float, y: float, channel: int) -> float:
    """Return the bilinear colour at a pixel position; integer coordinates are pixel corners."""
    height, width = photo.shape[:2]
    fx, fy = min(max(x - 0.5, 0.0), width - 1.001), min(max(y - 0.5, 0.0), height - 1.001)
    i, j = int(fx), int(fy)
    a, b = fx - i, fy - j
    top = (1 - a) * photo[j, i, channel] + a * photo[j, i + 1, channel]
    low = (1 - a) * photo[j + 1, i, channel] + a * photo[j + 1, i + 1, channel]
    return (1 - b) * top + b * low


def paint_photo(
    photo: Image,
    gain: Single,
    which: NDArray[np.int64],
    pixels: Single,
    texels: Single,
    node: NDArray[np.int32],
    correction: Single,
    atlas: Image,
    painted: NDArray[np.uint8],
) -> None:
    """Paint triangles from one photo, in place.

    Parameters
    ----------
    photo : (H, W, 3) uint8.
    gain : (3,) factor on the photo's colours.
    which : (n,) indices of the triangles, into the next three arrays.
    pixels : (F, 3, 2) position of each corner in the photo.
    texels : (F, 3, 2) position of each corner in the atlas, texels.
    node : (F, 3) row of each corner in `correction`.
    correction : (N, 3) colours that are added at the corners.
    atlas, painted : (S, S, 3) and (S, S), written.
    """
    side = atlas.shape[0]
    rows = _rows(which, texels, side)
    # Both neighbours cover the texels on their common edge. Bands of rows, each painted in the
    # order of the triangles, make the result independent of the threads.
    in_ranges(
        _paint_bands,
        (side + _BAND - 1) // _BAND,
        photo,
        gain,
        which,
        rows,
        pixels,
        texels,
        node,
        correction,
        atlas,
        painted,
    )


@kernel
def _paint_bands(
    begin: int,
    end: int,
    photo: Image,
    gain: Single,
    which: NDArray[np.int64],
    rows: NDArray[np.int32],
    pixels: Single,
    texels: Single,
    node: NDArray[np.int32],
    correction: Single,
    atlas: Image,
    painted: NDArray[np.uint8],
) -> None:
    """Paint the triangles in some bands of the atlas's rows."""
    for band in range(begin, end):
        top, bottom = band * _BAND, min((band + 1) * _BAND, len(atlas)) - 1
        for n in range(len(which)):
            y0, y1 = max(rows[n, 0], top), min(rows[n, 1], bottom)
            if y0 <= y1:
                f = which[n]
                _paint_rows(
                    photo, gain, pixels[f], texels[f], node[f], correction, y0, y1, atlas, painted
                )


@kernel
def _rows(which: NDArray[np.int64], texels: Single, side: int) -> NDArray[np.int32]:
    """Return the (n, 2) first and last row of each triangle in the atlas."""
    rows = np.empty((len(which), 2), dtype=np.int32)
    for n in range(len(which)):
        t = texels[which[n]]
        rows[n, 0] = max(0, int(np.floor(min(t[0, 1], t[1, 1], t[2, 1]) - 0.5)))
        rows[n, 1] = min(side - 1, int(np.ceil(max(t[0, 1], t[1, 1], t[2, 1]))))
    return rows


@kernel
def _paint_rows(
    photo: Image,
    gain: Single,
    p: Single,
    t: Single,
    n: NDArray[np.int32],
    g: Single,
    y0: int,
    y1: int,
    atlas: Image,
    painted: NDArray[np.uint8],
) -> None:
    """Paint rows y0 to y1 of one triangle.

    p, t : (3, 2) corners in the photo and in the atlas. n : (3,) their rows in the corrections g.
    """
    side = atlas.shape[1]
    det = (t[1, 0] - t[0, 0]) * (t[2, 1] - t[0, 1]) - (t[1, 1] - t[0, 1]) * (t[2, 0] - t[0, 0])
    if abs(det) < 1e-9:
        return
    x0 = max(0, int(np.floor(min(t[0, 0], t[1, 0], t[2, 0]) - 0.5)))
    x1 = min(side - 1, int(np.ceil(max(t[0, 0], t[1, 0], t[2, 0]))))
    for y in range(y0, y1 + 1):
        for x in range(x0, x1 + 1):
            dx, dy = x + 0.5 - t[0, 0], y + 0.5 - t[0, 1]
            b = (dx * (t[2, 1] - t[0, 1]) - dy * (t[2, 0] - t[0, 0])) / det
            c = (dy * (t[1, 0] - t[0, 0]) - dx * (t[1, 1] - t[0, 1])) / det
            a = 1.0 - b - c
            if a < -1e-4 or b < -1e-4 or c < -1e-4:
                continue
            px = a * p[0, 0] + b * p[1, 0] + c * p[2, 0]
            py = a * p[0, 1] + b * p[1, 1] + c * p[2, 1]
            for channel in range(3):
                value = _sample(photo, px, py, channel) * gain[channel]
                value += a * g[n[0], channel] + b * g[n[1], channel] + c * g[n[2], channel]
                atlas[y, x, channel] = np.uint8(min(max(value + 0.5, 0.0), 255.0))
            painted[y, x] = 1


@kernel
def paint_colours(
    which: NDArray[np.int64],
    texels: Single,
    colours: Single,
    atlas: Image,
    painted: NDArray[np.uint8],
) -> None:
    """Fill the bounding box of each triangle's texels with one colour (n, 3), in place."""
    side = atlas.shape[0]
    for n in range(len(which)):
        t = texels[which[n]]
        x0, x1 = int(min(t[0, 0], t[1, 0], t[2, 0])), int(max(t[0, 0], t[1, 0], t[2, 0]))
        y0, y1 = int(min(t[0, 1], t[1, 1], t[2, 1])), int(max(t[0, 1], t[1, 1], t[2, 1]))
        for y in range(max(0, y0), min(side - 1, y1) + 1):
            for x in range(max(0, x0), min(side - 1, x1) + 1):
                for channel in range(3):
                    atlas[y, x, channel] = np.uint8(colours[n, channel])
                painted[y, x] = 1


@kernel
def _sample_all(photo: Image, points: Single, out: Single) -> None:
    for n in range(len(points)):
        for channel in range(3):
            out[n, channel] = _sample(photo, points[n, 0], points[n, 1], channel)


def sample_points(photo: Image, points: Single) -> Single:
    """Return the (n, 3) float32 colours of a blurred photo at (n, 2) pixel positions."""
    out = np.zeros((len(points), 3), dtype=np.float32)
    _sample_all(np.asarray(cv2.GaussianBlur(photo, (0, 0), 1.5), dtype=np.uint8), points, out)
    return out
