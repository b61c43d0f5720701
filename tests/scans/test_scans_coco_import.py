"""COCO files in the layouts of other programs, written by hand from their documentation."""

from __future__ import annotations

import codecs
import json
from pathlib import Path
from typing import Any

import pytest

from walltopo.core import InputError
from walltopo.scans.coco_import import read_coco

OUTLINE = [10.0, 10.0, 30.0, 10.0, 30.0, 20.0, 10.0, 20.0]
IMAGE = {"id": 1, "file_name": "0001.jpg", "width": 64, "height": 48}
ROW = {"id": 1, "image_id": 1, "category_id": 1, "segmentation": [OUTLINE]}
CATEGORY = {"id": 1, "name": "hold"}


def coco(image: dict[str, Any], row: dict[str, Any], *categories: dict[str, Any]) -> dict[str, Any]:
    """Return a file of one photo and one object."""
    return {
        "images": [IMAGE | image],
        "annotations": [ROW | row],
        "categories": list(categories or (CATEGORY,)),
    }


RLE = {"size": [48, 64], "counts": [490, 10, 2572]}
LAYOUTS = {
    "pycocotools": coco({}, {"segmentation": RLE, "score": 0.75, "bbox": [10, 10, 1, 10]}),
    "CVAT": coco(
        {"license": 0, "flickr_url": "", "coco_url": "", "date_captured": 0},
        {"area": 200.0, "bbox": [10.0, 10.0, 20.0, 10.0], "iscrowd": 0, "attributes": {"t": False}},
        {"id": 1, "name": "hold", "supercategory": ""},
    ),
    "Label Studio": coco(
        {"file_name": "images\\\\0001.jpg", "id": 0},
        {"image_id": 0, "id": 0, "category_id": 0, "ignore": 0, "area": 200},
        {"id": 0, "name": "hold"},
    ),
    "Roboflow": coco(
        {"file_name": "0001_jpg.rf.7f2c.jpg", "extra": {"name": "0001.jpg"}, "license": 1},
        {"bbox": [10, 10, 20, 10], "area": 200, "iscrowd": 0},
        {"id": 0, "name": "holds", "supercategory": "none"},
        {"id": 1, "name": "hold", "supercategory": "holds"},
    ),
    "FiftyOne": coco(
        {"license": None, "coco_url": None},
        {"category_id": 0, "score": None, "iscrowd": 0},
        {"id": 0, "name": "hold", "supercategory": None},
    ),
    "X-AnyLabeling": coco(
        {"date_captured": ""}, {"ignore": 0, "area": 200.0}, {"id": 1, "name": "hold"}
    ),
    "ids as words": coco(
        {"id": "0001"}, {"image_id": "0001", "category_id": "h"}, {"id": "h", "name": "hold"}
    ),
    "numbers as floats": coco({"width": 64.0, "height": 48.0, "id": 1.0}, {"id": 7.0}),
    "a flat outline": coco({}, {"segmentation": OUTLINE}),
}


@pytest.mark.parametrize("program", LAYOUTS)
def test_the_layouts_of_other_programs_are_read(tmp_path: Path, program: str) -> None:
    path = tmp_path / "coco.json"
    path.write_text(json.dumps(LAYOUTS[program] | {"info": None, "licenses": []}))
    found = read_coco(path)
    ((name, (mask,)),) = found.masks.items()
    assert name.replace("\\", "/").removeprefix("images/").lstrip("/") == "0001.jpg"
    assert found.classes[mask.label] == "hold"
    assert mask.area == (10 if program == "pycocotools" else 200)
    assert mask.score == (0.75 if program == "pycocotools" else 1.0)


@pytest.mark.parametrize(
    "encoded",
    [
        codecs.BOM_UTF8 + json.dumps(coco({}, {})).encode(),
        json.dumps(coco({}, {})).encode("utf-16"),
        json.dumps(coco({}, {"area": float("nan")})).encode(),
    ],
)
def test_encodings_and_nan_where_it_does_not_count_are_read(tmp_path: Path, encoded: bytes) -> None:
    (tmp_path / "coco.json").write_bytes(encoded)
    assert len(read_coco(tmp_path / "coco.json").masks["0001.jpg"]) == 1


@pytest.mark.parametrize(
    ("data", "named"),
    [
        (coco({"width": None}, {}), r"images\[0\].width"),
        (coco({"width": 64.5}, {}), r"images\[0\].width"),
        (coco({}, {"segmentation": [[float("nan")] * 6]}), "annotation 1: outline 0"),
        (coco({}, {"score": float("nan")}), "annotation 1: .*score"),
        (coco({}, {"category_id": 9}), "category 9 does not exist"),
        (coco({}, {"segmentation": "yes"}), r"annotations\[0\].segmentation"),
        ({"images": {}}, "no list of images"),
        ([], "no list of images"),
    ],
)
def test_records_without_a_certain_meaning_are_named(
    tmp_path: Path, data: object, named: str
) -> None:
    (tmp_path / "coco.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match=named):
        read_coco(tmp_path / "coco.json")
