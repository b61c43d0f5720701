"""How crops are varied: places keep their pixels, mosaics their objects, files their keys."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError, SettingsError
from walltopo_lab.train.augment import Crop, crop_sample, mosaic
from walltopo_lab.train.cache import Sample
from walltopo_lab.train.params import AUGMENTS, AugmentSettings, read_augment
from walltopo_lab.train.paste import paste_objects


def square_sample(x: int, y: int, side: int, extent: int = 200) -> Sample:
    """A white square on black with a box as tight as can be."""
    image = np.zeros((extent, extent, 3), np.uint8)
    image[y : y + side, x : x + side] = 255
    ids = (image[..., 0] > 0).astype(np.int16)
    box = np.array([[x, y, x + side, y + side]], np.float32)
    corners = np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]], np.float32)
    return Sample("a", image, ids, np.array([1]), box, np.repeat(corners, 4, axis=0)[None])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_boxes_lie_on_their_pixels(seed: int) -> None:
    """Mirrored, turned over or scaled: the box stays where the object is, without a bias."""
    rng = np.random.default_rng(seed)
    plain = AUGMENTS["none"]
    varied = AugmentSettings(**{**vars(plain), "flip": 0.5, "flip_vertical": 0.5, "scale_high": 2})
    crop = crop_sample(square_sample(80, 90, 40), 256, varied, rng)
    rows, cols = np.nonzero(crop.image[..., 0] > 127)
    edge = len(rows) == 0 or min(rows.min(), cols.min()) == 0 or max(rows.max(), cols.max()) == 255
    if crop.seen[0] < 1 or edge or crop.image[0, 0, 0] > 100:
        return
    got = [cols.min(), rows.min(), cols.max() + 1, rows.max() + 1]
    np.testing.assert_allclose(got, crop.boxes[0], atol=0.75)


def test_without_augmentation_a_crop_is_the_photo() -> None:
    sample = square_sample(80, 90, 40)
    crop = crop_sample(sample, 256, AUGMENTS["none"], np.random.default_rng(0))
    scale = (1067 / 200) ** 0.7 if 1067 / 200 < 2.5 else 2.5**0.7
    size = crop.boxes[0, 2:] - crop.boxes[0, :2]
    np.testing.assert_allclose(size, 40 * scale, rtol=0.01)
    assert set(np.unique(crop.image[(crop.ids == 1)])) <= set(range(100, 256))


def crop_of(label: int, side: int = 64) -> Crop:
    """One object that fills the crop."""
    return Crop(
        np.full((side, side, 3), 50 * label, np.uint8),
        np.ones((side, side), np.int16),
        np.array([label]),
        np.array([[0.0, 0, side, side]]),
        np.ones(1),
    )


def test_a_mosaic_shows_each_in_its_quarter() -> None:
    made = mosaic([crop_of(k) for k in (1, 2, 1, 2)], np.random.default_rng(3))
    assert made.labels.tolist() == [1, 2, 1, 2]
    assert sorted(np.unique(made.ids)) == [1, 2, 3, 4]
    for k in range(4):
        rows, cols = np.nonzero(made.ids == k + 1)
        np.testing.assert_array_equal(
            made.boxes[k], [cols.min(), rows.min(), cols.max() + 1, rows.max() + 1]
        )
        assert made.seen[k] == pytest.approx(len(rows) / 64**2)
    assert made.seen.sum() == pytest.approx(1.0)
    with pytest.raises(InputError, match="crops"):
        mosaic([crop_of(1)] * 3, np.random.default_rng(0))


def test_a_fraction_of_a_crop_shows_the_photo() -> None:
    part = AugmentSettings(**{**vars(AUGMENTS["none"]), "crop_fraction": 0.3})
    sample = square_sample(0, 0, 200)
    seen = []
    for seed in range(30):
        crop = crop_sample(sample, 128, part, np.random.default_rng(seed))
        assert (crop.ids > 0).mean() <= 1
        x0, y0, x1, y1 = crop.boxes[0]
        assert (crop.ids > 0).sum() == pytest.approx((x1 - x0) * (y1 - y0), abs=260)
        seen.append(crop.seen[0])
    assert min(seen) < 0.1 < max(seen)


def test_presets_and_files(tmp_path: Path) -> None:
    assert read_augment("default") == AugmentSettings()
    assert read_augment("published").mosaic == 1.0
    file = tmp_path / "a.toml"
    file.write_text("mosaic = 0.5\nrotation = 90\n")
    assert read_augment(str(file)) == AugmentSettings(mosaic=0.5, rotation=90.0)


@pytest.mark.parametrize(
    ("text", "output"),
    [
        ("mosiac = 0.5", "unknown setting 'mosiac'.*mosaic"),
        ("hue = 'red'", "hue: expected a number, got 'red'"),
        ("hue = 2", "hue"),
    ],
)
def test_wrong_files_are_refused(tmp_path: Path, text: str, output: str) -> None:
    file = tmp_path / "a.toml"
    file.write_text(text)
    with pytest.raises(SettingsError, match=f"(?s){output}"):
        read_augment(str(file))
    file.write_text("hue = ")
    with pytest.raises(InputError, match="not valid TOML"):
        read_augment(str(file))
    with pytest.raises(InputError, match="file"):
        read_augment(str(tmp_path / "b.toml"))


def test_options_go_before_the_file(tmp_path: Path) -> None:
    import argparse

    from walltopo_lab.cli import train as command

    file = tmp_path / "a.toml"
    file.write_text("mosaic = 0.5\nhue = 0.2\n")
    parser = argparse.ArgumentParser()
    command.register(parser.add_subparsers())
    args = parser.parse_args(["train", "set", "-o", "x", "--augment", str(file), "--hue", "0.1"])
    made = command._augmentation(args)
    assert (made.mosaic, made.hue) == (0.5, 0.1)


def test_a_pasted_volume_takes_its_holds_along() -> None:
    source = crop_of(2)
    source.ids[:] = 0
    source.ids[10:40, 12:50] = 1
    source.ids[20:26, 20:28] = 2
    boxes = np.array([[12.0, 10, 50, 40], [20, 20, 28, 26]])
    source = Crop(source.image, source.ids, np.array([2, 1]), boxes, np.ones(2))
    for seed in range(20):
        target = crop_of(1)
        made = paste_objects(target, source, 1, np.random.default_rng(seed))
        assert made.labels.tolist() == [1, 2, 1]
        assert (target.ids == 1).all(), "the target itself stays as it is"
        for k in (1, 2):
            rows, cols = np.nonzero(made.ids == k + 1)
            shown = [cols.min(), rows.min(), cols.max() + 1, rows.max() + 1]
            np.testing.assert_array_equal(made.boxes[k], shown)
        assert 0.5 <= made.seen[1] <= 1
        assert made.image.min() >= 50


def test_what_pasted_objects_hide_is_not_requested() -> None:
    source = crop_of(2)
    target = crop_of(1)
    target.ids[:] = 0
    target.ids[30:34, 30:34] = 1
    boxes = np.array([[30.0, 30, 34, 34]])
    target = Crop(target.image, target.ids, np.array([1]), boxes, np.ones(1))
    seen = [
        paste_objects(target, source, 1, np.random.default_rng(seed)).seen[0] for seed in range(9)
    ]
    assert max(seen) == 0.1
    cut = Crop(source.image, source.ids, source.labels, source.boxes, np.array([0.5]))
    assert len(paste_objects(target, cut, 3, np.random.default_rng(0)).labels) == 1
