"""Split, stats, check, compare, refine and the contact sheet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from walltopo.core import InputError, Mask
from walltopo_lab.datasets.check import TURNS, check_dataset, turn_scores
from walltopo_lab.datasets.compare import compare_sets
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.refine import grabcut, mask_iou, refine_dataset
from walltopo_lab.datasets.shapes import ellipse, rectangle
from walltopo_lab.datasets.sheet import write_sheet
from walltopo_lab.datasets.split import group_of_photo, split
from walltopo_lab.datasets.stats import dataset_stats, write_stats_plot

CLASSES = {1: "hold", 2: "volume"}


def wall(path: Path, seed: int, size: tuple[int, int] = (400, 300)) -> Photo:
    """A plywood-coloured picture with coloured ovals, and their exact labels."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 6, (size[1], size[0], 3))
    picture = Image.fromarray(np.clip(np.array([190, 160, 120]) + noise, 0, 255).astype(np.uint8))
    draw = ImageDraw.Draw(picture)
    rows = []
    # Off centre, so that the labels fit in one way only.
    for _ in range(12):
        cx, cy = rng.uniform(20, size[0] * 0.6), rng.uniform(20, size[1] * 0.6)
        rx, ry = rng.uniform(6, 14, 2)
        colour = [(200, 30, 40), (30, 60, 190), (20, 140, 60)][int(rng.integers(3))]
        draw.ellipse([cx - rx, cy - ry, cx + rx, cy + ry], fill=colour)
        rows.append(Annotation(1, (cx - rx, cy - ry, 2 * rx, 2 * ry), (ellipse(cx, cy, rx, ry),)))
    picture.save(path, quality=92)
    return Photo(path.name, *size, tuple(rows), path)


def boxes_only(photo: Photo) -> Photo:
    return photo.with_annotations(tuple(Annotation(a.label, a.box) for a in photo.annotations))


@pytest.mark.parametrize(
    ("name", "group"),
    [
        ("IMG_8992.jpg", "IMG"),
        ("wall_img_12.jpg", "wall_img"),
        ("hall_jpg.rf.0123456789abcdef.jpg", "hall_jpg"),
        ("2022-12-07_15-01-30_UTC.jpg", "2022-12-07"),
        ("north/a7.jpg", "north"),
        ("17.jpg", "17"),
    ],
)
def test_groups_from_names(name: str, group: str) -> None:
    assert group_of_photo(Photo(name, 9, 9)) == group


def test_group_from_gym_or_pattern() -> None:
    assert group_of_photo(Photo("a1.jpg", 9, 9, gym="east"), "^(.)") == "east"
    assert group_of_photo(Photo("a1.jpg", 9, 9), "^(.)") == "a"
    with pytest.raises(InputError, match="fit"):
        group_of_photo(Photo("a1.jpg", 9, 9), "^(z)")
    with pytest.raises(InputError, match="pattern"):
        group_of_photo(Photo("a1.jpg", 9, 9), "^a")


@given(seed=st.integers(0, 1000), groups=st.integers(3, 20))
@settings(max_examples=50, deadline=None)
def test_split_keeps_groups_whole_and_loses_nothing(seed: int, groups: int) -> None:
    rng = np.random.default_rng(seed)
    photos = tuple(
        Photo(f"g{k}/{n}.jpg", 9, 9, (Annotation(1, (0, 0, 1, 1)),) * int(rng.integers(0, 9)))
        for k in range(groups)
        for n in range(int(rng.integers(1, 6)))
    )
    dataset = Dataset(photos, CLASSES)
    parts = split(dataset, {"train": 0.6, "valid": 0.2, "test": 0.2}, seed)
    names = [photo.name for part in parts.values() for photo in part.photos]
    assert sorted(names) == sorted(photo.name for photo in photos)
    gyms = [{photo.name.split("/")[0] for photo in part.photos} for part in parts.values()]
    assert all(gyms)
    assert len(set.union(*gyms)) == sum(map(len, gyms))


def test_split_refuses_too_few_groups() -> None:
    dataset = Dataset((Photo("a1.jpg", 9, 9), Photo("a2.jpg", 9, 9)), CLASSES)
    with pytest.raises(InputError, match="groups"):
        split(dataset, {"train": 0.5, "valid": 0.5})


def test_stats_and_plot(tmp_path: Path) -> None:
    dataset = Dataset((wall(tmp_path / "a.jpg", 0), Photo("b.jpg", 9, 9)), CLASSES)
    stats = dataset_stats(dataset)
    assert (stats["photos"], stats["objects"], stats["empty_photos"]) == (2, 12, 1)
    assert stats["classes"]["hold"]["with_shape"] == 12
    assert stats["classes"]["volume"]["objects"] == 0
    write_stats_plot(tmp_path / "s.png", dataset)
    assert Image.open(tmp_path / "s.png").size == (1120, 400)


def test_box_faults_are_found() -> None:
    rows = (
        Annotation(1, (10, 10, 20, 20)),
        Annotation(1, (10, 10, 20, 20)),
        Annotation(1, (90, 10, 20, 20)),
        Annotation(1, (200, 10, 20, 20)),
        Annotation(1, (10, 50, 0, 20)),
        Annotation(1, (10, 80, 2, 9)),
    )
    found = check_dataset(Dataset((Photo("a.jpg", 100, 100, rows),), CLASSES), pictures=False)
    assert [(f.annotation, f.kind) for f in found] == [
        (1, "duplicate"),
        (2, "outside"),
        (3, "outside"),
        (4, "empty"),
        (5, "tiny"),
    ]


@pytest.mark.parametrize("turn", list(TURNS)[1:])
def test_turned_labels_are_found(tmp_path: Path, turn: str) -> None:
    photo = wall(tmp_path / "a.jpg", 1, size=(300, 300))
    size = np.array([300.0, 300, 300, 300])
    corners = np.array([a.box for a in photo.annotations])
    corners[:, 2:] += corners[:, :2]
    turned = TURNS[turn](corners / size) * size
    rows = tuple(Annotation(1, (b[0], b[1], b[2] - b[0], b[3] - b[1])) for b in turned)
    (finding,) = check_dataset(Dataset((photo.with_annotations(rows),), CLASSES))
    assert finding.kind == "turned"
    assert not check_dataset(Dataset((photo,), CLASSES))
    assert turn_scores(photo)["as they are"] > 1


def test_missing_picture_is_a_finding() -> None:
    (finding,) = check_dataset(Dataset((Photo("a.jpg", 9, 9),), CLASSES))
    assert finding.kind == "unreadable"


def test_outline_outside_of_its_photo_is_a_finding() -> None:
    outline = np.array([[5.0, 5], [25, 5], [25, 9]])
    row = Annotation(1, (5.0, 5.0, 4.0, 4.0), (outline,))
    photo = Photo("a.jpg", 20, 20, (row,))
    (finding,) = check_dataset(Dataset((photo,), CLASSES), pictures=False)
    assert (finding.kind, finding.annotation) == ("outside", 0)


def test_picture_of_another_size_is_a_finding(tmp_path: Path) -> None:
    Image.new("RGB", (30, 40)).save(tmp_path / "a.jpg")
    photo = Photo("a.jpg", 40, 30, path=tmp_path / "a.jpg")
    (finding,) = check_dataset(Dataset((photo,), CLASSES))
    assert finding.kind == "unreadable"
    assert "30x40, its labels say 40x30" in finding.text


def test_compare_by_hand() -> None:
    half = (rectangle(0, 0, 5, 10),)
    whole = (rectangle(0, 0, 10, 10),)
    truth = Dataset((Photo("a.jpg", 20, 10, (Annotation(1, (0, 0, 10, 10), whole),)),), CLASSES)
    mine = Dataset((Photo("a.png", 20, 10, (Annotation(1, (0, 0, 5, 10), half),)),), CLASSES)
    result = compare_sets(mine, truth)
    assert result.per_class == pytest.approx({"none": 100 / 150, "hold": 0.5})
    assert result.miou == pytest.approx((2 / 3 + 0.5) / 2)
    assert result.instance_iou == pytest.approx(0.5)
    assert compare_sets(truth, truth).miou == 1.0
    with pytest.raises(InputError, match="common"):
        compare_sets(Dataset((Photo("z.jpg", 20, 10),), CLASSES), truth)


def bitmap(x: int, y: int, size: int) -> NDArray[np.bool_]:
    image = np.zeros((30, 30), dtype=np.bool_)
    image[y : y + size, x : x + size] = True
    return image


def test_mask_iou_is_that_of_full_bitmaps() -> None:
    a, b = Mask.from_full(bitmap(2, 3, 10), 1), Mask.from_full(bitmap(7, 3, 10), 1)
    assert mask_iou(a, b) == pytest.approx(50 / 150)
    assert mask_iou(a, Mask.from_full(bitmap(20, 20, 5), 1)) == 0.0


def test_grabcut_finds_ovals_in_boxes(tmp_path: Path) -> None:
    truth = Dataset((wall(tmp_path / "a.jpg", 2),), CLASSES)
    boxes = Dataset((boxes_only(truth.photos[0]),), CLASSES)
    refined, taken = refine_dataset(boxes, grabcut)
    assert taken >= 11
    assert (
        compare_sets(refined, truth).instance_iou > 0.85 > compare_sets(boxes, truth).instance_iou
    )


def test_refinement_that_disagrees_is_not_taken(tmp_path: Path) -> None:
    truth = Dataset((wall(tmp_path / "a.jpg", 3),), CLASSES)
    corner = Mask.from_full(np.pad(np.ones((5, 5), np.bool_), ((0, 295), (0, 395))), 1)
    same, taken = refine_dataset(truth, lambda image, masks, boxes: [corner] * len(masks))
    assert taken == 0
    assert compare_sets(same, truth).miou == 1.0
    oval, _ = refine_dataset(
        Dataset((boxes_only(truth.photos[0]),), CLASSES),
        lambda image, masks, boxes: [None] * len(masks),
    )
    assert compare_sets(oval, truth).instance_iou > 0.95  # ovals are what they are here


def test_sheet(tmp_path: Path) -> None:
    photos = tuple(wall(tmp_path / f"{k}.jpg", k) for k in range(3))
    assert write_sheet(tmp_path / "s.png", Dataset(photos, CLASSES), cell=200) == 3
    assert write_sheet(tmp_path / "s.png", Dataset(photos, CLASSES), ["1.jpg"], cell=200) == 1


def test_points_lie_deep_inside_and_apart() -> None:
    from walltopo_lab.datasets.refine import inner_points

    bitmap = np.zeros((40, 90), bool)
    bitmap[5:35, 5:85] = True
    bitmap[15:25, 35:55] = False
    mask = Mask(bitmap, 100, 200, 400, 400, 1, 1.0)
    points = inner_points(mask)
    for x, y in points:
        assert bitmap[int(y - 200), int(x - 100)]
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(3, 1)]
    assert gaps.min() > 8
    dot = inner_points(Mask(np.ones((1, 1), bool), 3, 4, 10, 10, 1, 1.0))
    np.testing.assert_allclose(dot, [[3.5, 4.5]] * 3)


def test_classes_are_named_anew() -> None:
    boxes = [Annotation(k, (10.0 * k, 0.0, 5.0, 5.0)) for k in (1, 2, 3, 4)]
    old = {1: "crimp", 2: "volume", 3: "marker", 4: "jug"}
    found = Dataset((Photo("a.jpg", 100, 100, tuple(boxes)),), old).reclassed(
        {"hold": ["*"], "volume": ["volume"], "card": ["marker"]}
    )
    assert found.classes == {1: "hold", 2: "volume", 3: "card"}
    assert [a.label for a in found.photos[0].annotations] == [1, 2, 3, 1]
    fewer = found.reclassed({"volume": ["volume"]})
    assert [(a.label, a.box[0]) for a in fewer.photos[0].annotations] == [(1, 20.0)]
    with pytest.raises(InputError, match="no class 'sloper'"):
        found.reclassed({"hold": ["sloper"]})
    with pytest.raises(InputError, match="two classes"):
        found.reclassed({"a": ["hold"], "b": ["hold"]})
