"""From labelled photos to what the network should answer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError, Mask
from walltopo.scans.detections import Detections
from walltopo.segment.detect.votes import decode_votes
from walltopo_lab.train.audit import TURNS, box_agreement, turn_boxes
from walltopo_lab.train.augment import Crop, crop_sample, shift_colours
from walltopo_lab.train.batches import source_of, split_sources
from walltopo_lab.train.cache import cache_coco, cache_yolo, open_cache, read_yolo_boxes
from walltopo_lab.train.params import AugmentSettings
from walltopo_lab.train.pseudomask import box_mask, hull_of, paint_instances
from walltopo_lab.train.targets import make_targets

DiscWall = Callable[..., np.ndarray]
DiscSet = Callable[..., Path]


def boxes_of(discs: list[tuple[int, int, int]]) -> np.ndarray:
    return np.array([[x - r, y - r, x + r + 1, y + r + 1] for x, y, r in discs], dtype=float)


def test_colour_tells_a_disc_from_its_box(disc_wall: DiscWall) -> None:
    discs = [(60, 70, 22), (150, 90, 14), (100, 180, 30)]
    ids, hulls, trusted = paint_instances(disc_wall(discs), boxes_of(discs))
    assert trusted == 3
    for k, (x, y, r) in enumerate(discs, start=1):
        true = (np.arange(240)[None] - x) ** 2 + (np.arange(240)[:, None] - y) ** 2 <= r * r
        assert ((ids == k) & true).sum() / ((ids == k) | true).sum() > 0.85
    np.testing.assert_allclose(hulls.min(axis=1), boxes_of(discs)[:, :2])
    np.testing.assert_allclose(hulls.max(axis=1), boxes_of(discs)[:, 2:])


def test_an_invisible_object_stays_undecided(disc_wall: DiscWall) -> None:
    wall = disc_wall([])
    box = np.array([[60.0, 60, 120, 110]])
    assert box_mask(wall, box[0], np.zeros(wall.shape[:2], bool), np.random.default_rng(0)) is None
    ids, _, trusted = paint_instances(wall, box)
    assert trusted == 0
    assert ids[85, 90] == 1
    assert (ids == -1).any()
    assert ids[61, 61] == 0


def test_boxes_beyond_the_border_do_no_harm(disc_wall: DiscWall) -> None:
    boxes = np.array([[-20.0, -10, 30, 30], [230, 230, 260, 260], [300, 300, 320, 330]])
    ids, hulls, _ = paint_instances(disc_wall([(10, 10, 18)]), boxes)
    assert ids.max() >= 1
    assert np.isfinite(hulls).all()


@given(st.integers(2, 30), st.integers(2, 30))
def test_a_hull_fills_its_box(h: int, w: int) -> None:
    rng = np.random.default_rng(h * 31 + w)
    mask = rng.random((h, w)) > 0.4
    mask[h // 2, w // 2] = True
    box = np.array([3.5, 4.5, 23.5, 44.5])
    hull = hull_of(mask, box)
    np.testing.assert_allclose(hull.min(axis=0), box[:2], atol=1e-4)
    np.testing.assert_allclose(hull.max(axis=0), box[2:], atol=1e-4)


def test_yolo_boxes_and_segments(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("0 0.5 0.5 0.2 0.4\n\n1 0.1 0.1 0.3 0.1 0.3 0.5\n")
    classes, boxes = read_yolo_boxes(file, 100, 50)
    assert classes.tolist() == [0, 1]
    np.testing.assert_allclose(boxes, [[40, 15, 60, 35], [10, 5, 30, 25]])


@pytest.mark.parametrize("line", ["0 0.5 0.5", "0 a b c d", "0 1 1 1 1 1"])
def test_a_broken_label_line_is_named(tmp_path: Path, line: str) -> None:
    file = tmp_path / "a.txt"
    file.write_text(f"0 0.5 0.5 0.2 0.4\n{line}\n")
    with pytest.raises(InputError, match="line 2"):
        read_yolo_boxes(file, 10, 10)


def test_caches_of_boxes_and_of_masks(tmp_path: Path, disc_set: DiscSet) -> None:
    names = cache_yolo(disc_set(tmp_path / "set", 2), tmp_path / "boxes")
    sample = open_cache(tmp_path / "boxes", names[0])
    assert sample.image.shape == (240, 240, 3)
    assert sample.labels.tolist() == [1, 1, 1, 1]
    assert set(np.unique(sample.ids)) >= {0, 1, 2, 3, 4}

    bitmap = np.zeros((240, 240), bool)
    bitmap[50:90, 60:100] = True
    other = np.zeros((240, 240), bool)
    other[60:70, 70:80] = True
    masks = (Mask.from_full(other, 1), Mask.from_full(bitmap, 2))
    coco = tmp_path / "set" / "labels.json"
    classes = {1: "hold", 2: "volume"}
    Detections({"wall0.png": masks}, {"wall0.png": (240, 240)}, classes).save(coco)
    cache_coco(coco, tmp_path / "set" / "images", tmp_path / "exact")
    exact = open_cache(tmp_path / "exact", "wall0.png")
    np.testing.assert_allclose(exact.boxes, [[70, 60, 80, 70], [60, 50, 100, 90]])
    assert exact.ids[65, 75] == 1, "the small one lies on top"
    assert exact.ids[55, 65] == 2
    with pytest.raises(InputError, match="cache"):
        open_cache(tmp_path / "exact", "none.png")


def test_crops_follow_their_objects(tmp_path: Path, disc_set: DiscSet) -> None:
    names = cache_yolo(disc_set(tmp_path / "set", 1), tmp_path / "boxes")
    sample = open_cache(tmp_path / "boxes", names[0])
    rng = np.random.default_rng(2)
    for _ in range(20):
        crop = crop_sample(sample, 192, AugmentSettings(), rng)
        for k in range(len(crop.labels)):
            rows, cols = np.nonzero(crop.ids == k + 1)
            if crop.seen[k] < 0.999 or len(rows) < 30:
                continue
            x0, y0, x1, y1 = crop.boxes[k]
            got = [cols.min(), rows.min(), cols.max() + 1, rows.max() + 1]
            np.testing.assert_allclose(got, [x0, y0, x1, y1], atol=0.2 * (x1 - x0) + 2)


def test_no_augmentation_of_colour_changes_little(disc_wall: DiscWall) -> None:
    plain = AugmentSettings(hue=0, hue_share=0, saturation=0, value=0, degrade=0)
    image = disc_wall([(50, 50, 20)])
    rng = np.random.default_rng(3)
    assert shift_colours(image, plain, rng).shape == image.shape


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_targets_decode_to_the_labels(seed: int) -> None:
    """Decoding perfect training targets gives the labels back."""
    rng = np.random.default_rng(seed)
    side, step = 256, 64
    ids = np.zeros((side, side), np.int16)
    boxes = []
    for k in range(9):
        x = 16 + step * (k % 3) + int(rng.integers(0, 8))
        y = 16 + step * (k // 3) + int(rng.integers(0, 8))
        w, h = rng.integers(12, 48, 2)
        boxes.append([x, y, x + w, y + h])
        ids[y : y + h, x : x + w] = k + 1
    labels = rng.integers(1, 3, 9)
    image = np.zeros((side, side, 3), np.uint8)
    crop = Crop(image, ids, labels, np.array(boxes, dtype=float), np.ones(9))
    t = make_targets(crop)
    found = decode_votes(t.heat, t.votes, t.mask, 0.9, 1.0, (side, side))
    order = np.lexsort((found.boxes[:, 0].round(), found.boxes[:, 1].round()))
    wanted = np.lexsort((np.array(boxes)[:, 0], np.array(boxes)[:, 1]))
    assert len(found) == 9
    np.testing.assert_allclose(found.boxes[order], np.array(boxes)[wanted], atol=0.51)
    np.testing.assert_array_equal(found.labels[order], labels[wanted])


def test_little_seen_objects_are_not_requested() -> None:
    ids = np.zeros((64, 64), np.int16)
    crop = Crop(
        np.zeros((64, 64, 3), np.uint8),
        ids,
        np.array([1]),
        np.array([[0.0, 10, 6, 30]]),
        np.array([0.2]),
    )
    t = make_targets(crop)
    assert t.heat.max() == 0
    assert t.heat_weight[0, 4, 0] == 0
    assert t.heat_weight[1].min() == 1
    assert t.vote_weight.max() == 0


def test_copies_of_a_photo_are_never_parted() -> None:
    names = [f"photo{n}.jpg.rf.{copy}.jpg" for n in range(200) for copy in "abc"]
    train, kept = split_sources(names, 0.2)
    assert not {source_of(n) for n in train} & {source_of(n) for n in kept}
    assert 0.1 < len(kept) / len(names) < 0.3
    more = split_sources([*names, "another.jpg"], 0.2)
    assert set(kept) <= set(more[1])
    days = [f"2022-12-07_14-{m:02d}-00_UTC.jpg" for m in range(60)]
    assert min(len(part) for part in split_sources(days, 0.5)) == 0


@pytest.mark.parametrize("turn", [t for t in TURNS if t != "as labelled"])
def test_turned_labels_are_found_out(turn: str) -> None:
    rng = np.random.default_rng(4)
    corner = rng.uniform(0.05, 0.85, (40, 2))
    found = np.concatenate([corner, corner + rng.uniform(0.03, 0.08, (40, 2))], axis=1)
    back = {"turned 90": "turned 270", "turned 270": "turned 90"}.get(turn, turn)
    verdict = box_agreement("a.jpg", turn_boxes(found, back), found)
    assert verdict.wrong
    assert verdict.turn == turn
    assert verdict.turned > 0.9
    assert not box_agreement("a.jpg", found, found).wrong
    shifted = found + 0.002
    assert not box_agreement("a.jpg", shifted, found).wrong
