"""Tiles cover the photo; objects that a seam cut become one again."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import Mask
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.detect.tiles import Tile, merge_tiles, tiles_of


@given(st.integers(1, 3000), st.integers(1, 3000), st.integers(64, 900), st.integers(0, 400))
def test_tiles_cover_and_share(width: int, height: int, tile: int, overlap: int) -> None:
    tiles = tiles_of(width, height, tile, overlap)
    columns = sorted({(t.x0, t.x1) for t in tiles})
    assert columns[0][0] == 0
    assert columns[-1][1] == width
    for (_, end), (start, _) in itertools.pairwise(columns):
        assert end - start >= min(overlap, tile // 2) - 1
    assert all(t.x1 - t.x0 <= tile and t.y1 - t.y0 <= tile for t in tiles)
    assert len(tiles) == len(columns) * len({(t.y0, t.y1) for t in tiles})


def seen_in(tile: Tile, truth: list[tuple[int, int, int, int, int]]) -> PhotoDetections:
    """Return what a perfect detector sees of rectangles (x0, y0, x1, y1, label) in one tile."""
    boxes, labels, masks = [], [], []
    w, h = tile.x1 - tile.x0, tile.y1 - tile.y0
    for x0, y0, x1, y1, label in truth:
        u0, u1 = max(x0, tile.x0) - tile.x0, min(x1, tile.x1) - tile.x0
        v0, v1 = max(y0, tile.y0) - tile.y0, min(y1, tile.y1) - tile.y0
        if u1 - u0 < 4 or v1 - v0 < 4:
            continue
        boxes.append([u0, v0, u1, v1])
        labels.append(label)
        masks.append(Mask(np.ones((v1 - v0, u1 - u0), bool), u0, v0, w, h, label, 0.8))
    return PhotoDetections(
        w,
        h,
        np.array(boxes, dtype=float).reshape(-1, 4),
        np.full(len(boxes), 0.8),
        np.array(labels, dtype=np.int64),
        tuple(masks),
    )


def test_whole_photo_from_tiles() -> None:
    truth = [
        (10, 10, 40, 40, 1),  # in one tile only
        (220, 50, 260, 90, 1),  # whole in the strip two tiles share
        (150, 120, 420, 200, 2),  # wider than the strip: cut in both tiles
        (280, 20, 330, 60, 1),
        (285, 64, 330, 90, 1),  # its neighbour
    ]
    tiles = tiles_of(500, 220, 300, 100)
    assert len(tiles) == 2
    merged = merge_tiles([(t, seen_in(t, truth)) for t in tiles], 500, 220)
    got = sorted(
        (*map(int, box), int(label)) for box, label in zip(merged.boxes, merged.labels, strict=True)
    )
    assert got == sorted(truth)
    for box, mask in zip(merged.boxes, merged.masks, strict=True):
        assert mask.area == (box[2] - box[0]) * (box[3] - box[1])
        assert (mask.width, mask.height) == (500, 220)


def test_different_classes_are_not_joined() -> None:
    left, right = Tile(0, 0, 300, 100), Tile(200, 0, 500, 100)
    a = seen_in(left, [(150, 10, 400, 90, 1)])
    b = seen_in(right, [(150, 10, 400, 90, 2)])
    assert len(merge_tiles([(left, a), (right, b)], 500, 100)) == 2


def test_no_objects() -> None:
    tile = Tile(0, 0, 10, 10)
    assert len(merge_tiles([(tile, seen_in(tile, []))], 10, 10)) == 0
