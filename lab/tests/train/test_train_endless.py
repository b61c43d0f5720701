"""Training without end: it resumes after a kill, keeps what is prepared, ignores what it must."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
from lab.tests.train.networks import SMALL, trained_norms

from walltopo.core import InputError, Mask, Silent
from walltopo.core.files import read_json, write_json
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo_lab.train import cache, pseudomask, shipped, shipped_sets
from walltopo_lab.train.augment import Crop
from walltopo_lab.train.batches import source_of
from walltopo_lab.train.cache import (
    DONT_KNOW,
    IGNORED,
    MAYBE_VOLUME,
    Sample,
    cache_boxes,
    cache_coco,
    cache_yolo,
    open_cache,
)
from walltopo_lab.train.choose import figures_of, mask_iou
from walltopo_lab.train.export import export_onnx
from walltopo_lab.train.loop import load_run
from walltopo_lab.train.net import build_net
from walltopo_lab.train.params import TrainSettings
from walltopo_lab.train.shipped_export import comparison_table, replace_shipped
from walltopo_lab.train.shipped_sets import SOURCES, Source, is_validation, validation_parts
from walltopo_lab.train.targets import make_targets
from walltopo_lab.train.warm import measure_norms

DiscSet = Callable[..., Path]


def test_measured_norms_leave_the_function_unchanged() -> None:
    net = trained_norms(build_net(SMALL)).eval()
    photo = torch.rand(4, 3, 96, 96) * 255
    measured = copy.deepcopy(net)
    measure_norms(measured, [photo[:2], photo[2:]])
    with torch.no_grad():
        expected, plain = net(photo), measured(photo)
        live = measured.train()(photo)
    for a, b, c in zip(expected, plain, live, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-3, atol=1e-3)
        torch.testing.assert_close(a, c, rtol=1e-2, atol=1e-2)


def test_ignored_places_carry_no_loss() -> None:
    ids = np.zeros((64, 64), np.int16)
    ids[:32, :32] = IGNORED
    ids[32:, :32] = MAYBE_VOLUME
    empty = np.zeros((64, 64, 3), np.uint8)
    targets = make_targets(Crop(empty, ids, np.zeros(0, int), np.zeros((0, 4)), np.zeros(0)))
    for weight, step in ((targets.heat_weight, 4), (targets.mask_weight, 2)):
        middle = 32 // step
        assert (weight[:, :middle, :middle] == 0).all()
        assert (weight[0, middle:, :middle] == 1).all(), "no hold is known to be there"
        assert (weight[1, middle:, :middle] == 0).all(), "a volume may be there"
        assert (weight[:, :, middle:] == 1).all()


def test_detections_in_ignored_places_do_not_count() -> None:
    ids = np.zeros((100, 100), np.int16)
    ids[10:30, 10:30] = 1
    ids[:, 50:] = IGNORED
    boxes = np.array([[10.0, 10, 30, 30], [60, 60, 80, 80]])
    found = PhotoDetections(100, 100, boxes, np.array([0.5, 0.9]), np.array([1, 1]))
    image = np.zeros((100, 100, 3), np.uint8)
    hulls = np.zeros((1, 16, 2), np.float32)
    sample = Sample("a", image, ids, np.array([1]), boxes[:1].astype(np.float32), hulls)
    assert figures_of([found], [sample])["ap50_hold"] == pytest.approx(1.0)
    ids[:, 50:] = 0
    assert figures_of([found], [sample])["ap50_hold"] < 0.6


def coco(folder: Path) -> Path:
    """A photo with a hold, a volume, an unsure object and a marker."""
    (folder / "images").mkdir(parents=True)
    cv2.imwrite(str(folder / "images" / "a.png"), np.full((80, 100, 3), 150, np.uint8))
    corners = [(10, 10), (60, 10), (10, 50), (60, 50)]
    rows = [
        {
            "id": k + 1,
            "image_id": 1,
            "category_id": k + 1,
            "bbox": [x, y, 20, 20],
            "segmentation": [[x, y, x + 20, y, x + 20, y + 20, x, y + 20]],
            "iscrowd": 0,
            "area": 400,
        }
        for k, (x, y) in enumerate(corners)
    ]
    names = ("hold", "volume", "marker", "unsure")
    image = {"id": 1, "file_name": "a.png", "width": 100, "height": 80}
    categories = [{"id": k + 1, "name": name} for k, name in enumerate(names)]
    path = folder / "annotations.json"
    write_json(path, {"images": [image], "annotations": rows, "categories": categories})
    return path


@pytest.mark.parametrize("exact", [True, False])
def test_categories_are_read_as_a_set_means_them(tmp_path: Path, exact: bool) -> None:
    file = coco(tmp_path / "set")
    if exact:
        cache_coco(file, file.parent / "images", tmp_path / "c", None, {1: 1, 2: 2, 4: DONT_KNOW})
    else:
        named = {"hold": 1, "volume": 2, "unsure": DONT_KNOW}
        cache_boxes(file, file.parent / "images", tmp_path / "c", named)
    sample = open_cache(tmp_path / "c", "a.png")
    assert sample.labels.tolist() == [1, 2]
    np.testing.assert_allclose(sample.boxes, [[10, 10, 30, 30], [60, 10, 80, 30]])
    assert (sample.ids[20, 20], sample.ids[20, 70]) == (1, 2)
    assert sample.ids[60, 20] == 0, "a marker is background"
    assert sample.ids[60, 70] == IGNORED


def test_a_set_of_holds_alone_says_nothing_of_volumes(tmp_path: Path, disc_set: DiscSet) -> None:
    data = disc_set(tmp_path / "set", 1)
    cache_yolo(data, tmp_path / "c", volumes_labelled=False)
    ids = open_cache(tmp_path / "c", "wall0.png").ids
    assert (ids == MAYBE_VOLUME).any()
    assert not (ids == 0).any()


def test_what_is_prepared_is_found_until_it_changes(
    tmp_path: Path, disc_set: DiscSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, folder = disc_set(tmp_path / "set", 3), tmp_path / "c"
    painted = []
    original = pseudomask.paint_instances

    def count(image: np.ndarray, boxes: np.ndarray) -> object:
        painted.append(len(boxes))
        return original(image, boxes)

    monkeypatch.setattr(cache, "paint_instances", count)
    cache_yolo(data, folder)
    assert len(painted) == 3
    assert len(cache_yolo(data, folder)) == 3
    assert len(painted) == 3, "nothing was repeated"
    labels = data / "labels" / "wall1.txt"
    labels.write_text("\n".join(labels.read_text().splitlines()[:2]))
    cache_yolo(data, folder)
    assert painted[3:] == [2], "changed labels are prepared again"
    monkeypatch.setattr(cache, "PREPARED_VERSION", cache.PREPARED_VERSION + 1)
    cache_yolo(data, folder)
    assert len(painted) == 7, "a new way of preparing invalidates all"


def test_validation_is_by_gym_and_fixed() -> None:
    boxes, outlines, typed, liam = SOURCES
    for name in ("img8.jpg.rf.0a.jpg", "wall_img_23.jpg.rf.1b.jpg", "swall_2_png.jpg.rf.2c.jpg"):
        assert is_validation(boxes, name)
    for name in ("images-5-.jpg.rf.0a.jpg", "IMG_0380.jpg.rf.0a.jpg", "2LF7evuasW7xupMN9.jpg"):
        assert not is_validation(boxes, name)
    series = {f"training_{k}_jpg.jpg" for k in range(20, 35)}
    assert not any(is_validation(outlines, name) for name in series), "one gym stays together"
    assert is_validation(outlines, "training_1_jpg.jpg")
    assert not any(is_validation(typed, f"rockwall{k}_jpg.jpg") for k in (1, 3, 20, 29))
    assert is_validation(liam, "IMG_7331.jpg")
    assert liam.share == 0, "a set that only validates gives no crops"


@pytest.fixture
def small_world(
    tmp_path: Path, disc_set: DiscSet, monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, shipped.TrainingFolder]:
    """Two small sets and a small shipped network; settings with a check every few steps."""
    data = tmp_path / "data"
    disc_set(data / "discs", 4)
    sources = (Source("discs", "yolo", 1.0, ("wall3*",)),)
    net = trained_norms(build_net(SMALL))
    export_onnx(net, tmp_path / "start.onnx", {"size": SMALL.as_dict()}, half=False)
    settings = TrainSettings(minutes=0, crop=96, batch=2, check_every=0.0, rate=1e-3)
    monkeypatch.setattr(shipped_sets, "SOURCES", sources)
    monkeypatch.setattr(shipped, "QUICK_CHECK", {"discs": 1})
    monkeypatch.setattr(shipped, "SETTINGS", settings)
    monkeypatch.setattr(shipped, "shipped_model", lambda: tmp_path / "start.onnx")
    return data, shipped.TrainingFolder(tmp_path / "state")


class Killed(Silent):
    """Stop a run abruptly after so many checks."""

    def __init__(self, checks: int) -> None:
        self.left = checks

    def note(self, message: str) -> None:
        self.left -= message.startswith("check")
        if self.left == 0:
            raise RuntimeError("killed")


@pytest.mark.slow
def test_a_killed_run_goes_on(small_world: tuple[Path, shipped.TrainingFolder]) -> None:
    data, state = small_world
    with pytest.raises(RuntimeError, match="killed"):
        shipped.run(data, state, Killed(4))
    first = load_run(state.checkpoint, shipped.SETTINGS)
    assert first.step == first.first_step + 2 == 2
    assert len(first.history) == 3, "the start and two steps; the last check was not saved"
    with pytest.raises(RuntimeError, match="killed"):
        shipped.run(data, state, Killed(3))
    second = load_run(state.checkpoint, shipped.SETTINGS)
    assert second.step == first.step + 2
    assert second.history[:3] == first.history
    assert second.cpu_seconds > first.cpu_seconds
    assert read_json(state.folder / "history.json") == second.history
    page = state.page.read_text()
    assert "<svg" in page
    assert page.count("<tr>") == 1 + len(second.history)


@pytest.mark.slow
def test_export_compares_with_the_shipped_network(
    small_world: tuple[Path, shipped.TrainingFolder], tmp_path: Path
) -> None:
    data, state = small_world
    with pytest.raises(RuntimeError, match="killed"):
        shipped.run(data, state, Killed(3))
    made = shipped.export(data, state, Silent(), cool_steps=2)
    assert made.photos == {"discs": 1, "all": 1}
    assert made.shipped["all"].keys() == made.exported["all"].keys() >= {"score", "ap50_hold"}
    table = comparison_table(made)
    assert "| discs | 1 | " in table
    assert table.count("->") >= 2
    steps, _ = shipped.training_of(state.exported)
    assert steps == 1 + 2
    target = tmp_path / "target.onnx"
    worse = replace(made, exported={"all": {"score": 0.1}}, shipped={"all": {"score": 0.2}})
    assert not replace_shipped(worse, state.exported, target)
    assert not target.exists()
    better = replace(made, exported={"all": {"score": 0.3}}, shipped={"all": {"score": 0.2}})
    assert replace_shipped(better, state.exported, target)
    assert target.read_bytes() == state.exported.read_bytes()


def test_masks_are_matched_with_drawn_outlines() -> None:
    ids = np.zeros((60, 60), np.int16)
    ids[10:30, 10:30], ids[35:55, 35:55] = 1, 2
    boxes = np.array([[10.0, 10, 30, 30], [35, 35, 55, 55]])
    hulls = np.zeros((2, 16, 2), np.float32)
    image = np.zeros((60, 60, 3), np.uint8)
    sample = Sample("a", image, ids, np.array([1, 1]), boxes.astype(np.float32), hulls)
    half = ids == 2
    half[45:] = False
    masks = (Mask.from_full(ids == 1, 1, 0.9), Mask.from_full(half, 1, 0.8))
    found = PhotoDetections(60, 60, boxes, np.array([0.9, 0.8]), np.array([1, 1]), masks)
    np.testing.assert_allclose(mask_iou(found, sample), np.array([[1, 0], [0, 0.5]]))
    figures = figures_of([found], [sample], [True])
    assert figures["mask50_hold"] == pytest.approx(1.0)
    assert figures["score"] == pytest.approx(1.0)
    masks = (masks[0], Mask.from_full(ids == 1, 1, 0.8))
    found = PhotoDetections(60, 60, boxes, np.array([0.9, 0.8]), np.array([1, 1]), masks)
    assert figures_of([found], [sample], [True])["mask50_hold"] == pytest.approx(51 / 101)


@pytest.mark.slow
def test_validation_photos_are_not_trained_on(
    small_world: tuple[Path, shipped.TrainingFolder],
) -> None:
    data, state = small_world
    sets, shares = shipped_sets.open_shipped_sets(data, state.rendered, state.prepared, Silent())
    assert shares == [1.0]
    parts = validation_parts(sets)
    held_out = {name for part in parts for _, name in part.photos}
    assert held_out == {"wall3.png"}
    assert not held_out & set(sets[0].train)
    assert not {source_of(n) for n in held_out} & {source_of(n) for n in sets[0].train}


@pytest.mark.slow
def test_one_run_a_folder(small_world: tuple[Path, shipped.TrainingFolder]) -> None:
    _, state = small_world
    with state.only_run(), pytest.raises(InputError, match="using"), state.only_run():
        pass


def test_missing_data_is_named(tmp_path: Path) -> None:
    state = shipped.TrainingFolder(tmp_path / "state")
    with pytest.raises(InputError, match="hold-boxes"):
        shipped.run(tmp_path / "nowhere", state, Silent())
