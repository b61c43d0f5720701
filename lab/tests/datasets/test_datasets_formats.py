"""Each format: what it writes it reads back; real files of each program; broken ones."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from walltopo.core import InputError, Mask
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.read import FORMATS, read_dataset, write_dataset
from walltopo_lab.datasets.shapes import ellipse, join_outlines, mask_of, polygons_of_mask
from walltopo_lab.datasets.yolo import read_names


def make_set(folder: Path) -> Dataset:
    """Two photos: a box, an outline and a two-part object; and one with nothing in it."""
    folder.mkdir(parents=True)
    for name, size in (("a.jpg", (60, 40)), ("b.jpg", (30, 50))):
        Image.new("RGB", size, (90, 120, 60)).save(folder / name)
    outline = np.array([[5.0, 5], [20, 5], [20, 15], [5, 15]])
    parts = (ellipse(40, 10, 5, 4), ellipse(50, 30, 4, 5))
    rows = (
        Annotation(1, (2.0, 20.0, 10.0, 12.0)),
        Annotation(2, (5.0, 5.0, 15.0, 10.0), (outline,)),
        Annotation(1, (35.0, 6.0, 19.0, 29.0), parts),
    )
    photos = (
        Photo("a.jpg", 60, 40, rows, folder / "a.jpg"),
        Photo("b.jpg", 30, 50, (), folder / "b.jpg"),
    )
    return Dataset(photos, {1: "hold", 2: "volume"})


@pytest.mark.parametrize("kind", FORMATS)
def test_round_trip(tmp_path: Path, kind: str) -> None:
    before = make_set(tmp_path / "photos")
    write_dataset(tmp_path / "out", before, kind)
    after = read_dataset(tmp_path / "out")
    assert dict(after.classes) == dict(before.classes)
    assert [p.name for p in after.photos] == ["a.jpg", "b.jpg"]
    assert [(p.width, p.height) for p in after.photos] == [(60, 40), (30, 50)]
    assert after.photos[1].annotations == ()
    assert after.photos[0].pixels().shape == (40, 60, 3)
    drawn = {label: np.zeros((40, 60), dtype=np.bool_) for label in (1, 2)}
    expected = {label: np.zeros((40, 60), dtype=np.bool_) for label in (1, 2)}
    for target, dataset in ((drawn, after), (expected, before)):
        for row in dataset.photos[0].annotations:
            x, y, w, h = row.box
            box_only = kind == "yolo" or (target is expected and not row.has_shape)
            shape = Annotation(row.label, (x, y, w, h)) if box_only else row
            if kind == "yolo" and target is expected:
                shape = Annotation(row.label, row.box)
            target[row.label] |= mask_of(shape, dataset.photos[0]).full()
    for label in (1, 2):
        assert (drawn[label] != expected[label]).mean() < 0.005


@st.composite
def bitmaps(draw: st.DrawFn) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    seed = draw(st.integers(0, 100_000))
    rng = np.random.default_rng(seed)
    image = np.zeros((24, 30), dtype=np.bool_)
    for _ in range(int(rng.integers(1, 6))):
        x, y, w, h = rng.integers(0, 20), rng.integers(0, 16), *rng.integers(1, 10, 2)
        image[y : y + h, x : x + w] = True
    return image


@given(bitmap=bitmaps())
@settings(max_examples=150, deadline=None)
def test_outline_of_a_bitmap_draws_it_again(
    bitmap: np.ndarray[tuple[int, int], np.dtype[np.bool_]],
) -> None:
    from scipy.ndimage import binary_fill_holes

    mask = Mask.from_full(binary_fill_holes(bitmap), 1)
    photo = Photo("x", 30, 24)
    polygons = polygons_of_mask(mask)
    again = mask_of(Annotation(1, (0, 0, 1, 1), polygons), photo)
    # Pixels that touch at a corner only may join or part.
    assert (again.full() != mask.full()).sum() <= 2
    one = mask_of(Annotation(1, (0, 0, 1, 1), (join_outlines(polygons),)), photo)
    assert (one.full() != mask.full()).sum() <= 4


@pytest.mark.parametrize(
    "text",
    [
        "names: {0: hold, 1: volume}\n",
        "nc: 2\nnames: ['hold', \"volume\"]\ntrain: x\n",
        "names:\n  0: hold\n  1: volume\ntrain: x\n",
        "names:\n- hold\n- volume\n",
    ],
)
def test_names_of_data_yaml(tmp_path: Path, text: str) -> None:
    assert read_names(tmp_path / "data.yaml", text) == {0: "hold", 1: "volume"}


def test_via_project_with_all_shapes(tmp_path: Path) -> None:
    Image.new("RGB", (50, 40)).save(tmp_path / "w.png")
    shapes = [
        {"name": "rect", "x": 1, "y": 2, "width": 3, "height": 4},
        {"name": "circle", "cx": 20, "cy": 20, "r": 5},
        {"name": "ellipse", "cx": 30, "cy": 20, "rx": 5, "ry": 3},
        {"name": "polygon", "all_points_x": [1, 9, 5], "all_points_y": [30, 30, 38]},
        {"name": "point", "cx": 3, "cy": 3},
    ]
    regions = [{"shape_attributes": s, "region_attributes": {"type": "hold"}} for s in shapes]
    project = {"_via_img_metadata": {"w.png9": {"filename": "w.png", "regions": regions}}}
    (tmp_path / "via.json").write_text(json.dumps(project))
    (photo,) = read_dataset(tmp_path / "via.json").photos
    assert [row.has_shape for row in photo.annotations] == [False, True, True, True]
    assert mask_of(photo.annotations[1], photo).area == pytest.approx(np.pi * 25, rel=0.1)


def test_labelme_groups_circles_and_embedded_picture(tmp_path: Path) -> None:
    Image.new("RGB", (50, 40)).save(tmp_path / "w.png")
    content = base64.b64encode((tmp_path / "w.png").read_bytes()).decode()
    (tmp_path / "w.png").unlink()
    square = [[1, 1], [5, 1], [5, 5], [1, 5]]
    shapes = [
        {"label": "hold", "points": square, "shape_type": "polygon", "group_id": 3},
        {"label": "hold", "points": [[20, 1], [30, 9]], "shape_type": "rectangle", "group_id": 3},
        {"label": "hold", "points": [[20, 20], [25, 20]], "shape_type": "circle"},
        {"label": "hold", "points": [[0, 0], [9, 9]], "shape_type": "line"},
    ]
    document = {"shapes": shapes, "imagePath": "..\\w.png", "imageData": content}
    (tmp_path / "w.json").write_text(json.dumps(document))
    (photo,) = read_dataset(tmp_path).photos
    assert (photo.width, photo.height, len(photo.annotations)) == (50, 40, 2)
    assert len(photo.annotations[0].polygons) == 2
    assert photo.pixels().shape == (40, 50, 3)


def test_coco_keeps_extras_and_moves_class_zero(tmp_path: Path) -> None:
    row = {"id": 1, "image_id": 7, "category_id": 0, "bbox": [1, 2, 3, 4], "route_id": 5}
    data = {
        "images": [{"id": 7, "file_name": "x.jpg", "width": 9, "height": 9, "gym": "north"}],
        "annotations": [row],
        "categories": [{"id": 0, "name": "hold"}, {"id": 1, "name": "volume"}],
    }
    (tmp_path / "c.json").write_text(json.dumps(data))
    dataset = read_dataset(tmp_path / "c.json")
    (photo,) = dataset.photos
    assert dict(dataset.classes) == {2: "hold", 1: "volume"}
    assert photo.gym == "north"
    assert photo.annotations[0].extra == {"route_id": 5}
    with pytest.raises(InputError, match="beside"):
        write_dataset(tmp_path / "o", dataset, "coco")
    write_dataset(tmp_path / "o", dataset, "coco", copy_photos=False)
    assert read_dataset(tmp_path / "o").photos[0].annotations[0].extra == {"route_id": 5}


def test_broken_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="such"):
        read_dataset(tmp_path / "none")
    with pytest.raises(InputError, match="labelled"):
        read_dataset(tmp_path)
    (tmp_path / "j.json").write_text("[1]")
    with pytest.raises(InputError, match="LabelMe"):
        read_dataset(tmp_path / "j.json")
    make_set(tmp_path / "y/images")
    (tmp_path / "y/labels").mkdir()
    (tmp_path / "y/labels/a.txt").write_text("0 0.5 0.5 0.1\n")
    with pytest.raises(InputError, match=r"a\.txt:1"):
        read_dataset(tmp_path / "y")


def test_photo_without_label_file_is_not_labelled(tmp_path: Path) -> None:
    make_set(tmp_path / "images")
    (tmp_path / "labels").mkdir()
    (tmp_path / "labels/b.txt").write_text("")
    assert [photo.name for photo in read_dataset(tmp_path).photos] == ["b.jpg"]


@pytest.mark.data
def test_real_sets(data_root: Path) -> None:
    valid = read_dataset(data_root / "hold-boxes/valid")
    assert (len(valid.photos), dict(valid.classes)) == (178, {1: "hold", 2: "volume"})
    masks = read_dataset(data_root / "hold-masks/annotations.json")
    assert sum(len(photo.annotations) for photo in masks.photos) == 1109
    assert all(photo.path for photo in masks.photos)
    assert len(read_dataset(data_root / "spraywall").photos) == 2


def labelme_of(folder: Path, *shapes: Mapping[str, object]) -> Path:
    """Write a LabelMe file of one photo of 20x18 pixels with these shapes."""
    file = {"shapes": list(shapes), "imagePath": "a.jpg", "imageWidth": 20, "imageHeight": 18}
    (folder / "a.json").write_text(json.dumps(file))
    return folder / "a.json"


def test_a_mask_of_labelme_is_an_object(tmp_path: Path) -> None:
    import base64
    import io

    from PIL import Image

    bitmap = np.array([[True, False, True], [True, True, True]])
    stream = io.BytesIO()
    Image.fromarray(bitmap).save(stream, "PNG")
    packed = base64.b64encode(stream.getvalue()).decode()
    corners = [[4.0, 5.0], [6.0, 6.0]]
    shape: dict[str, object] = {
        "label": "hold",
        "shape_type": "mask",
        "points": corners,
        "mask": packed,
    }
    ((found,),) = [photo.annotations for photo in read_dataset(labelme_of(tmp_path, shape)).photos]
    assert found.mask is not None
    assert (found.mask.box, found.mask.area) == ((4, 5, 3, 2), 5)
    shape["points"] = [[18.0, 5.0], [20.0, 6.0]]
    (photo,) = read_dataset(labelme_of(tmp_path, shape)).photos
    (cut,) = photo.annotations
    assert cut.mask is not None
    assert (cut.mask.box, cut.mask.area, cut.box) == ((18, 5, 2, 2), 3, (18, 5, 3, 2))
    shape["points"] = [[40.0, 5.0], [43.0, 6.0]]
    with pytest.raises(InputError, match="outside of the photo"):
        read_dataset(labelme_of(tmp_path, shape))


def test_shapes_that_are_left_out_are_counted(tmp_path: Path) -> None:
    line: Mapping[str, object] = {
        "label": "hold",
        "shape_type": "linestrip",
        "points": [[1, 1], [5, 5], [9, 1]],
    }
    new: Mapping[str, object] = {
        "label": "hold",
        "shape_type": "oriented_rectangle",
        "points": [[1, 1], [5, 5]],
    }
    area: Mapping[str, object] = {
        "label": "hold",
        "shape_type": "polygon",
        "points": [[1, 1], [5, 5], [9, 1]],
    }
    found = read_dataset(labelme_of(tmp_path, line, line, new, area))
    assert found.not_read == {"linestrip": 2, "oriented_rectangle": 1}
    with pytest.raises(InputError, match="1 of 'linestrip', 1 of 'oriented_rectangle'"):
        read_dataset(labelme_of(tmp_path, line, new))


def test_lines_of_via_are_counted(tmp_path: Path) -> None:
    Image.new("RGB", (20, 18)).save(tmp_path / "a.jpg")
    shapes = [
        {"name": "polyline", "all_points_x": [1, 5], "all_points_y": [1, 5]},
        {"name": "rect", "x": 1, "y": 1, "width": 5, "height": 5},
    ]
    regions = [{"shape_attributes": one, "region_attributes": {}} for one in shapes]
    (tmp_path / "via.json").write_text(json.dumps({"a": {"filename": "a.jpg", "regions": regions}}))
    assert read_dataset(tmp_path / "via.json").not_read == {"polyline": 1}


def test_lines_and_key_points_of_coco_are_counted(tmp_path: Path) -> None:
    row = {"image_id": 1, "category_id": 1}
    box: dict[str, object] = {**row, "bbox": [1, 1, 5, 5]}
    line = {**box, "segmentation": [[1, 1, 5, 5]]}
    points = {**row, "keypoints": [3, 3, 2], "segmentation": []}
    file: dict[str, object] = {
        "images": [{"id": 1, "file_name": "a.jpg", "width": 20, "height": 18}],
        "categories": [{"id": 1, "name": "hold"}],
    }
    path = tmp_path / "labels.json"
    path.write_text(json.dumps(file | {"annotations": [box, line, points, points]}))
    found = read_dataset(path)
    assert found.not_read == {"line": 1, "keypoints": 2}
    assert [len(photo.annotations) for photo in found.photos] == [1]
    path.write_text(json.dumps(file | {"annotations": [line]}))
    with pytest.raises(InputError, match="1 of 'line'"):
        read_dataset(path)


def test_key_points_of_yolo_are_no_outline(tmp_path: Path) -> None:
    for part in ("train", "valid"):
        folder = tmp_path / part
        (folder / "images").mkdir(parents=True)
        (folder / "labels").mkdir()
        Image.new("RGB", (20, 18)).save(folder / "images" / f"{part}.jpg")
        # A box, then two points with their visibility.
        pose = "0 0.5 0.5 0.2 0.2 0.4 0.4 2 0.6 0.6 2\n"
        (folder / "labels" / f"{part}.txt").write_text(pose)
    (tmp_path / "data.yaml").write_text("kpt_shape: [2, 3]\nnames: [hold]\n")
    found = read_dataset(tmp_path)
    assert found.not_read == {"keypoints": 2}
    objects = [annotation for photo in found.photos for annotation in photo.annotations]
    assert [o.box for o in objects] == [pytest.approx((8, 7.2, 4, 3.6))] * 2
    assert not any(o.has_shape for o in objects)


def test_files_of_other_programs_are_named(tmp_path: Path) -> None:
    cvat = tmp_path / "annotations.xml"
    cvat.write_text('<?xml version="1.0"?>\n<annotations><version>1.1</version></annotations>')
    for source in (cvat, tmp_path):
        with pytest.raises(InputError, match="CVAT") as failure:
            read_dataset(source)
        assert "COCO" in failure.value.hint
    studio = tmp_path / "studio.json"
    studio.write_text('[{"id": 1, "annotations": [], "data": {"image": "a.jpg"}}]')
    with pytest.raises(InputError, match="Label Studio") as failure:
        read_dataset(studio)
    assert "COCO" in failure.value.hint
