"""Masks from run lengths and outlines: the same as COCO's own code makes; hostile ones refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from faster_coco_eval.core import mask as coco
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from walltopo.core import InputError, Mask
from walltopo.scans.detections import Detections
from walltopo.scans.segmentation import Rle, decode_segmentation, encode_mask

SIDES = st.integers(1, 40)


@settings(max_examples=200, deadline=None)
@given(hnp.arrays(np.bool_, st.tuples(SIDES, SIDES)))
def test_run_lengths_come_back(bitmap: NDArray[np.bool_]) -> None:
    whole = Mask.from_full(bitmap, 1, 0.5)
    encoded = encode_mask(whole)
    height, width = bitmap.shape
    shape = Rle((height, width), encoded["counts"])
    read = decode_segmentation(shape, width, height, 1, 0.5)
    assert read.box == whole.box
    np.testing.assert_array_equal(read.bitmap, whole.bitmap)


@settings(max_examples=200, deadline=None)
@given(st.data(), SIDES, SIDES)
def test_outlines_are_drawn_as_coco_draws_them(
    data: st.DataObject, width: int, height: int
) -> None:
    point = st.tuples(st.floats(-width, 2 * width), st.floats(-height, 2 * height))
    outline = st.lists(point, min_size=3, max_size=8).map(lambda p: tuple(np.ravel(p).tolist()))
    outlines = tuple(data.draw(st.lists(outline, min_size=1, max_size=4)))
    read = decode_segmentation(outlines, width, height, 1, 0.5)
    runs = coco.merge(coco.frPyObjects([list(o) for o in outlines], height, width))
    np.testing.assert_array_equal(read.full(), coco.decode(runs).astype(np.bool_))


def _file(tmp_path: Path, width: int, height: int, shapes: list[Any]) -> Path:
    rows = [
        {"id": k, "image_id": 1, "category_id": 1, "segmentation": shape}
        for k, shape in enumerate(shapes)
    ]
    image = {"id": 1, "file_name": "a.jpg", "width": width, "height": height}
    data = {"images": [image], "categories": [{"id": 1, "name": "hold"}], "annotations": rows}
    (tmp_path / "d.json").write_text(json.dumps(data))
    return tmp_path / "d.json"


@pytest.mark.parametrize(
    ("shape", "named"),
    [
        ({"size": [8, 10], "counts": [2**31, 2**31]}, "run of"),
        ({"size": [8, 10], "counts": [10, 20]}, "30 pixels in a picture of 80"),
        ({"size": [8, 10], "counts": [2**62] * 4}, "run of"),
        ({"size": [2**31, 2**31], "counts": [1]}, "size"),
        ({"size": [60_000, 60_000], "counts": [3_600_000_000]}, "too large"),
        ({"size": [8, 10], "counts": "oooooooooooooooo0"}, "RLE"),
        ([[1, 1, 5, 5, 9]], "odd"),
        ([[1e300, 1, 5, 5, 9, 9]], "far outside"),
        ([[2**70, 1, 5, 5, 9, 9]], "far outside"),
    ],
)
def test_hostile_shapes_are_named(tmp_path: Path, shape: Any, named: str) -> None:
    with pytest.raises(InputError, match=rf"d\.json.*{named}"):
        Detections.load(_file(tmp_path, 10, 8, [shape]))


@pytest.mark.slow
def test_masks_that_fill_the_memory_are_refused(tmp_path: Path) -> None:
    shape = {"size": [16_000, 15_000], "counts": [0, 240_000_000]}
    with pytest.raises(InputError, match=r"annotation 4: .*memory"):
        Detections.load(_file(tmp_path, 15_000, 16_000, [shape] * 9))
