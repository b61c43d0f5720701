"""Labels made to harm: names that lead out, shapes without end, pictures of other kinds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from walltopo.cli import main
from walltopo.core import InputError
from walltopo_lab.datasets.read import read_dataset
from walltopo_lab.datasets.shapes import join_outlines

SQUARE = [2, 2, 9, 2, 9, 9, 2, 9]


def _coco(folder: Path, **changes: Any) -> Path:
    """A set of one photo; keys `image`, `row` and `more` change it."""
    folder.mkdir(exist_ok=True)
    image = {"id": 1, "file_name": "a.png", "width": 20, "height": 18} | changes.get("image", {})
    row = {"id": 1, "image_id": 1, "category_id": 1, "segmentation": [SQUARE]}
    rows = [row | changes.get("row", {}), *changes.get("rows", [])]
    data = {
        "images": [image, *changes.get("images", [])],
        "categories": [{"id": 1, "name": "hold"}],
        "annotations": rows,
    }
    Image.new("RGB", (20, 18)).save(folder / "a.png")
    (folder / "labels.json").write_text(json.dumps(data))
    return folder / "labels.json"


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("name", ["{root}/out.png", "../out.png", "images/../../out.png"])
def test_convert_writes_nothing_outside_its_target(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Image.new("RGB", (20, 18)).save(tmp_path / "out.png")
    labels = _coco(tmp_path / "in", image={"file_name": name.format(root=tmp_path)})
    before = _files(tmp_path)
    for kind in ("coco", "yolo", "labelme"):
        given = ["dataset", "convert", str(labels), str(tmp_path / "to" / kind), "--to", kind]
        assert main(given) == 3
        assert "leads out of its folder" in " ".join("".join(capsys.readouterr()).split())
    assert _files(tmp_path) == before


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"row": {"segmentation": [[1, 2, 3, 4, 5]]}}, "odd number"),
        ({"row": {"segmentation": [[1e300, 2, 3, 4, 5, 6]]}}, "far outside"),
        ({"row": {"bbox": [0, 0, 1e300, 1]}}, "far outside"),
        ({"row": {"segmentation": {"size": [2**31, 2**31], "counts": [0]}}}, "size"),
        ({"row": {"segmentation": {"size": [18, 20], "counts": [0, 3]}}}, "3 pixels in a picture"),
        ({"row": {"segmentation": {"size": [18, 20], "counts": "aaa"}}}, "RLE"),
        ({"row": {"category_id": 9}}, "no category 9"),
        ({"row": {"image_id": 9}}, "no image 9"),
        ({"images": [{"id": 1, "file_name": "b", "width": 2, "height": 2}]}, "image id 1 occurs"),
        ({"image": {"width": 2**31}}, "width"),
        ({"image": {"width": 60_000, "height": 60_000}}, "too large"),
        ({"row": {"tags": json.loads("[" * 90 + "]" * 90)}}, "nested"),
    ],
)
def test_shapes_that_are_none_are_named(
    tmp_path: Path, changes: dict[str, Any], named: str
) -> None:
    with pytest.raises(InputError, match=rf"labels\.json.*{named}"):
        read_dataset(_coco(tmp_path / "in", **changes))


def test_an_outline_without_end_is_refused(tmp_path: Path) -> None:
    zigzag = np.tile([0.0, 0.0, 20.0, 18.0], 150_000).tolist()
    with pytest.raises(InputError, match="too long for an object"):
        read_dataset(_coco(tmp_path / "in", row={"segmentation": [zigzag]}))


def test_twenty_thousand_parts_become_one_outline() -> None:
    parts = [np.array(SQUARE, dtype=np.float64).reshape(-1, 2) + k for k in range(20_000)]
    outline = join_outlines(parts)
    x, y = outline.T
    area = abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1))) / 2
    assert area == pytest.approx(20_000 * 49)  # bridges have no area


def test_a_postscript_named_jpg_is_no_picture(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    _coco(folder, image={"file_name": "a.jpg"})
    (folder / "a.jpg").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 20 18\nshowpage\n")
    (photo,) = read_dataset(folder).photos
    with pytest.raises(InputError, match=r"a\.jpg: not an image that is read here"):
        photo.pixels()


def test_labelme_takes_only_the_name_of_a_way_that_leads_up(tmp_path: Path) -> None:
    shapes = [{"label": "hold", "points": [[1, 1], [9, 1], [9, 9]]}]
    for folder in ("labels", "images"):
        (tmp_path / folder).mkdir()
    Image.new("RGB", (20, 18)).save(tmp_path / "images" / "a.png")
    document = {"shapes": shapes, "imagePath": "..\\images\\a.png"}
    (tmp_path / "labels" / "a.json").write_text(json.dumps(document))
    (photo,) = read_dataset(tmp_path / "labels" / "a.json").photos
    assert photo.path == tmp_path / "images" / "a.png"
    (tmp_path / "labels" / "a.json").write_text(
        json.dumps(document | {"imagePath": "/etc/hostname", "imageWidth": 20, "imageHeight": 18})
    )
    (photo,) = read_dataset(tmp_path / "labels" / "a.json").photos
    assert photo.path is None


def test_convert_does_not_copy_what_a_link_leads_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    labels = _coco(tmp_path / "in")
    secret = tmp_path / "secret.png"
    (tmp_path / "in" / "a.png").rename(secret)
    (tmp_path / "in" / "a.png").symlink_to(secret)
    for kind in ("coco", "yolo", "labelme"):
        given = ["dataset", "convert", str(labels), str(tmp_path / "to" / kind), "--to", kind]
        assert main(given) == 3
        assert "a link" in capsys.readouterr().err
    assert not [path for path in _files(tmp_path) if path.is_relative_to(tmp_path / "to")]
