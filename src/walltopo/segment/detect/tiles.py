"""Large photos in overlapping tiles, and one object again where a seam cut it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask
from walltopo.segment.detect.found import Found, box_iou

_AT_SEAM = 3.0  # px: a box that ends this near to an inner tile border was cut by it
_SAME = 0.5  # share of the smaller one, within what both tiles see, that makes two one object


@dataclass(frozen=True)
class Tile:
    """A rectangle of the photo: x0, y0, x1, y1 in pixels, end exclusive."""

    x0: int
    y0: int
    x1: int
    y1: int


def _starts(length: int, tile: int, overlap: int) -> list[int]:
    if length <= tile:
        return [0]
    count = int(np.ceil((length - overlap) / (tile - overlap)))
    return [round(k * (length - tile) / (count - 1)) for k in range(count)]


def tiles_of(width: int, height: int, tile: int, overlap: int) -> list[Tile]:
    """Tiles of at most `tile` px that cover the photo, neighbours sharing >= `overlap` px."""
    overlap = min(overlap, tile // 2)
    return [
        Tile(x, y, min(x + tile, width), min(y + tile, height))
        for y in _starts(height, tile, overlap)
        for x in _starts(width, tile, overlap)
    ]


def _is_cut(box: NDArray[np.float64], tile: Tile, width: int, height: int) -> bool:
    return bool(
        (tile.x0 > 0 and box[0] <= tile.x0 + _AT_SEAM)
        or (tile.y0 > 0 and box[1] <= tile.y0 + _AT_SEAM)
        or (tile.x1 < width and box[2] >= tile.x1 - _AT_SEAM)
        or (tile.y1 < height and box[3] >= tile.y1 - _AT_SEAM)
    )


def _shifted(mask: Mask, tile: Tile, width: int, height: int) -> Mask:
    return replace(mask, x=mask.x + tile.x0, y=mask.y + tile.y0, width=width, height=height)


def _union(a: Mask, b: Mask) -> Mask:
    x0, y0 = min(a.x, b.x), min(a.y, b.y)
    x1 = max(a.x + a.bitmap.shape[1], b.x + b.bitmap.shape[1])
    y1 = max(a.y + a.bitmap.shape[0], b.y + b.bitmap.shape[0])
    bitmap = np.zeros((y1 - y0, x1 - x0), np.bool_)
    for m in (a, b):
        h, w = m.bitmap.shape
        bitmap[m.y - y0 : m.y - y0 + h, m.x - x0 : m.x - x0 + w] |= m.bitmap
    return replace(a, bitmap=bitmap, x=x0, y=y0, score=max(a.score, b.score))


def _window(mask: Mask, x0: int, y0: int, x1: int, y1: int) -> NDArray[np.bool_]:
    """The mask within a rectangle of the photo, as a bitmap of the rectangle's size."""
    out = np.zeros((max(0, y1 - y0), max(0, x1 - x0)), np.bool_)
    h, w = mask.bitmap.shape
    u0, u1 = max(x0, mask.x), min(x1, mask.x + w)
    v0, v1 = max(y0, mask.y), min(y1, mask.y + h)
    if u1 > u0 and v1 > v0:
        out[v0 - y0 : v1 - y0, u0 - x0 : u1 - x0] = mask.bitmap[
            v0 - mask.y : v1 - mask.y, u0 - mask.x : u1 - mask.x
        ]
    return out


def _same_object(
    a: Mask | None,
    b: Mask | None,
    box_a: NDArray[np.float64],
    box_b: NDArray[np.float64],
    tile_a: Tile,
    tile_b: Tile,
) -> bool:
    """Whether two detections agree within the strip that both tiles see."""
    x0, y0 = max(tile_a.x0, tile_b.x0), max(tile_a.y0, tile_b.y0)
    x1, y1 = min(tile_a.x1, tile_b.x1), min(tile_a.y1, tile_b.y1)
    if x1 <= x0 or y1 <= y0:
        return False
    if a is None or b is None:
        strip = np.array([x0, y0, x1, y1], dtype=np.float64)
        clip_a = np.concatenate(
            [np.maximum(box_a[:2], strip[:2]), np.minimum(box_a[2:], strip[2:])]
        )
        clip_b = np.concatenate(
            [np.maximum(box_b[:2], strip[:2]), np.minimum(box_b[2:], strip[2:])]
        )
        return bool(box_iou(clip_a[None], clip_b[None])[0, 0] > _SAME)
    in_a, in_b = _window(a, x0, y0, x1, y1), _window(b, x0, y0, x1, y1)
    least = min(np.count_nonzero(in_a), np.count_nonzero(in_b))
    return bool(least > 0 and np.count_nonzero(in_a & in_b) > _SAME * least)


def merge_tiles(parts: Sequence[tuple[Tile, Found]], width: int, height: int) -> Found:
    """One `Found` of the whole photo.

    Whole objects beat cut ones; two cut parts that agree in the strip both tiles see are joined.
    """
    boxes, scores, labels, cut, tiles = [], [], [], [], []
    masks: list[Mask | None] = []
    for tile, found in parts:
        for k in range(len(found)):
            box = found.boxes[k] + [tile.x0, tile.y0, tile.x0, tile.y0]
            boxes.append(box)
            scores.append(float(found.scores[k]))
            labels.append(int(found.labels[k]))
            cut.append(_is_cut(box, tile, width, height))
            tiles.append(tile)
            masks.append(_shifted(found.masks[k], tile, width, height) if found.masks else None)
    order = sorted(range(len(boxes)), key=lambda k: (cut[k], -scores[k]))
    chosen: list[int] = []
    for k in order:
        for other in chosen:
            if labels[other] != labels[k] or tiles[other] == tiles[k]:
                continue
            a, b = boxes[other], boxes[k]
            if a[0] > b[2] or b[0] > a[2] or a[1] > b[3] or b[1] > a[3]:
                continue
            if _same_object(masks[other], masks[k], a, b, tiles[other], tiles[k]):
                scores[other] = max(scores[other], scores[k])
                if cut[other] and cut[k]:
                    boxes[other] = np.concatenate(
                        [np.minimum(a[:2], b[:2]), np.maximum(a[2:], b[2:])]
                    )
                    first, second = masks[other], masks[k]
                    if first is not None and second is not None:
                        masks[other] = _union(first, second)
                break
        else:
            chosen.append(k)
    chosen.sort(key=lambda k: -scores[k])
    kept = [m for m in (masks[k] for k in chosen) if m is not None]
    return Found(
        width,
        height,
        np.array([boxes[k] for k in chosen], dtype=np.float64).reshape(-1, 4),
        np.array([scores[k] for k in chosen], dtype=np.float64),
        np.array([labels[k] for k in chosen], dtype=np.int64),
        tuple(kept),
    )
