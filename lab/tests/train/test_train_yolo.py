"""Ultralytics' own trainer on the same sets; its arguments and files are tested without it."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from walltopo.core import EnvironmentLacksError, InputError, SettingsError, Silent
from walltopo.core.files import read_json
from walltopo.segment.detect.onnx_detector import open_onnx
from walltopo_lab.train.detector import Job
from walltopo_lab.train.params import AUGMENTS, YoloSettings, is_yolo
from walltopo_lab.train.sets import open_sets
from walltopo_lab.train.yolo import train_arguments, train_yolo
from walltopo_lab.train.yolo_data import label_lines, write_yolo_set


@pytest.mark.usefixtures("ultralytics")
def test_trains_resumes_exports(tmp_path: Path, disc_set: Callable[..., Path]) -> None:
    job = Job((disc_set(tmp_path / "set", 8),), tmp_path / "run", ("discs, made here",))
    settings = YoloSettings(minutes=0.2, size=64, held_out=0.25, batch=4)

    def stop(epoch: int, _: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_yolo(job, "yolo11n-seg", settings, AUGMENTS["published"], Silent(), stop)
    assert not (job.out / "holds.onnx").exists()
    seen: list[int] = []
    train_yolo(
        job, "yolo11n-seg", settings, AUGMENTS["none"], Silent(), lambda n, _: seen.append(n)
    )
    assert seen[0] == 2, "it goes on after the epoch that was saved"
    history = read_json(job.out / "history.json")
    assert [entry["epoch"] for entry in history["epochs"]] == list(range(1, seen[-1] + 1))
    model = open_onnx(job.out / "holds.onnx", "cpu", 1)
    assert model.head == "yolo-seg"
    assert model.metadata["base"] == "yolo11n-seg"
    card = (job.out / "holds.md").read_text()
    assert "AGPL-3.0" in card
    assert "discs, made here" in card
    train_yolo(job, "yolo11n-seg", settings, AUGMENTS["none"], Silent())
    assert read_json(job.out / "history.json") == history, "what is done stays done"
    with pytest.raises(InputError, match="yolo11n-seg"):
        train_yolo(job, "rtdetr-l", settings, AUGMENTS["none"], Silent())


@pytest.mark.usefixtures("ultralytics")
def test_pretrained_weights_must_be_there(tmp_path: Path, disc_set: Callable[..., Path]) -> None:
    job = Job((disc_set(tmp_path / "set"),), tmp_path / "run", pretrained=tmp_path / "none.pt")
    with pytest.raises(InputError, match="pretrained"):
        train_yolo(
            job, "yolo11n-seg", YoloSettings(size=64, held_out=0.0), AUGMENTS["none"], Silent()
        )


@pytest.mark.skipif(importlib.util.find_spec("ultralytics") is not None, reason="installed here")
def test_without_the_extra_it_says_so(tmp_path: Path) -> None:
    job = Job((tmp_path,), tmp_path / "run")
    with pytest.raises(EnvironmentLacksError, match="ultralytics"):
        train_yolo(job, "yolo11s-seg", YoloSettings(), AUGMENTS["none"], Silent())


def test_the_same_photos_as_ultralytics_reads_them(
    tmp_path: Path, disc_set: Callable[..., Path]
) -> None:
    sets = open_sets((disc_set(tmp_path / "set", 12),), tmp_path / "cache", 0.3, Silent())
    data = write_yolo_set(sets, tmp_path / "data", segments=True)
    train = sorted((tmp_path / "data/images/train").iterdir())
    held = sorted((tmp_path / "data/images/val").iterdir())
    assert len(train) == len(sets[0].train)
    assert len(held) == len(sets[0].held_out) > 0
    assert "val: images/val" in data.read_text()
    for picture in train:
        image = cv2.imread(str(picture))
        assert image is not None
        height, width = image.shape[:2]
        lines = (tmp_path / f"data/labels/train/{picture.stem}.txt").read_text().splitlines()
        name = picture.stem.split("-")[-1]
        original = (tmp_path / f"set/labels/{Path(name).stem}.txt").read_text().splitlines()
        assert len(lines) == len(original) == 4
        for line, given in zip(lines, original, strict=True):
            points = np.array(line.split()[1:], float).reshape(-1, 2)
            x, y, w, h = (float(v) for v in given.split()[1:])
            extent = [*points.min(axis=0), *points.max(axis=0)]
            np.testing.assert_allclose(
                extent, [x - w / 2, y - h / 2, x + w / 2, y + h / 2], atol=1.1 / min(width, height)
            )


def test_exact_masks_keep_their_outline() -> None:
    from walltopo_lab.train.cache import Sample

    ids = np.zeros((100, 100), np.int16)
    cv2.circle(ids, (50, 50), 20, 1, -1)
    box = np.array([[30, 30, 71, 71]], np.float32)
    corners = np.array([[30, 30], [71, 30], [71, 71], [30, 71]], np.float32)
    hull = np.repeat(corners, 4, axis=0)[None]
    sample = Sample("a", np.zeros((100, 100, 3), np.uint8), ids, np.array([2]), box, hull)
    (line,) = label_lines(sample, exact=True, segments=True)
    assert line.startswith("1 ")
    points = (np.array(line.split()[1:], float).reshape(-1, 1, 2) * 100).astype(np.float32)
    assert cv2.contourArea(points) == pytest.approx(np.pi * 20**2, rel=0.08)
    (plain,) = label_lines(sample, exact=True, segments=False)
    np.testing.assert_allclose(np.array(plain.split()[1:], float), [0.505, 0.505, 0.41, 0.41])


def test_arguments_follow_the_settings(tmp_path: Path) -> None:
    requests = train_arguments(YoloSettings(), AUGMENTS["none"], tmp_path / "d.yaml", tmp_path)
    zero = ("hsv_h", "hsv_s", "hsv_v", "degrees", "translate", "scale", "flipud", "fliplr")
    assert [requests[key] for key in zero] == [0] * 8
    assert "device" not in requests
    published = train_arguments(
        YoloSettings(device="cpu"), AUGMENTS["published"], tmp_path / "d.yaml", tmp_path
    )
    assert [published[key] for key in ("hsv_h", "degrees", "scale")] == [1.0, 180.0, 0.5]
    assert published["device"] == "cpu"


def test_names_of_networks() -> None:
    assert all(map(is_yolo, ("yolo11s-seg", "yolo11x", "rtdetr-l")))
    assert not any(map(is_yolo, ("votes", "yolo11", "rtdetr-s", "yolo11s-pose")))


def test_options_of_the_other_kind_are_refused() -> None:
    import argparse

    from walltopo_lab.cli import train as command

    parser = argparse.ArgumentParser()
    command.register(parser.add_subparsers())
    words = ["train", "set", "-o", "x", "--model", "yolo11s-seg", "--crop", "64"]
    with pytest.raises(SettingsError, match="--crop"):
        command.run(parser.parse_args(words))
    with pytest.raises(InputError, match="best"):
        command.run(parser.parse_args(["train", "set", "-o", "x", "--model", "best"]))
