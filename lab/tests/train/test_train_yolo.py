"""Ultralytics' trainer, imitated: what it is asked for, and what is made of what it leaves."""

from __future__ import annotations

import importlib.util
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")

from walltopo.core import EnvironmentLacksError, InputError, SettingsError, Silent  # noqa: E402
from walltopo.detect.onnx_model import open_onnx  # noqa: E402
from walltopo_lab.train.detector import Job  # noqa: E402
from walltopo_lab.train.params import AUGMENTS, YoloSettings, is_yolo  # noqa: E402
from walltopo_lab.train.sets import open_sets  # noqa: E402
from walltopo_lab.train.yolo import train_arguments, train_yolo  # noqa: E402
from walltopo_lab.train.yolo_data import label_lines, write_yolo_set  # noqa: E402


def save_network(path: Path, names: str) -> Path:
    """An exported YOLO-seg that sees nothing."""
    helper, numpy_helper = onnx.helper, onnx.numpy_helper
    shapes = ((1, 38, 84), (1, 32, 16, 16))
    nodes, results = [], []
    for k, shape in enumerate(shapes):
        tensor = numpy_helper.from_array(np.zeros(shape, np.float32), f"value{k}")
        nodes.append(helper.make_node("Constant", [], [f"output{k}"], value=tensor))
        results.append(helper.make_tensor_value_info(f"output{k}", 1, shape))
    photo = helper.make_tensor_value_info("images", 1, [1, 3, 64, 64])
    graph = helper.make_graph(nodes, "constant", [photo], results)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    for key, text in {"task": "segment", "names": names}.items():
        entry = model.metadata_props.add()
        entry.key, entry.value = key, text
    onnx.save(model, path)
    return path


class FakeTrainer:
    """Trains three epochs; stops in the second when told so."""

    calls: list[tuple[str, Any]] = []  # noqa: RUF012
    interrupt = False
    folder = Path()

    def __init__(self, source: Any) -> None:
        self.source = str(source)
        self.calls.append(("open", self.source))

    def load(self, weights: str) -> FakeTrainer:
        self.calls.append(("load", weights))
        return self

    def add_callback(self, event: str, function: Callable[[Any], None]) -> None:
        assert event == "on_fit_epoch_end"
        self.told = function

    def train(self, **arguments: Any) -> None:
        self.calls.append(("train", arguments))
        if "project" in arguments:
            type(self).folder = Path(arguments["project"]) / "ultralytics" / "weights"
        self.folder.mkdir(parents=True, exist_ok=True)
        for epoch in range(3):
            (self.folder / "last.pt").write_bytes(b"last")
            metrics = {"metrics/mAP50(B)": 0.9, "metrics/mAP50(M)": 0.1 * epoch}
            self.told(types.SimpleNamespace(epoch=epoch, metrics=metrics))
            if self.interrupt and epoch == 1:
                raise KeyboardInterrupt
        (self.folder / "best.pt").write_bytes(b"best")

    def export(self, **arguments: Any) -> str:
        self.calls.append(("export", arguments))
        return str(save_network(self.folder / "best.onnx", "{0: 'hold', 1: 'volume'}"))


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> type[FakeTrainer]:
    module = types.ModuleType("ultralytics")
    module.YOLO = module.RTDETR = FakeTrainer  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "ultralytics", module)
    monkeypatch.setattr(FakeTrainer, "calls", [])
    monkeypatch.setattr(FakeTrainer, "interrupt", False)
    return FakeTrainer


def test_trains_resumes_exports(
    library: type[FakeTrainer], tmp_path: Path, disc_set: Callable[..., Path]
) -> None:
    job = Job((disc_set(tmp_path / "set"),), tmp_path / "run", ("discs, made here",))
    settings = YoloSettings(minutes=6, size=64, held_out=0.0, rate=0.02)
    library.interrupt = True
    with pytest.raises(KeyboardInterrupt):
        train_yolo(job, "yolo11s-seg", settings, AUGMENTS["published"], Silent())
    library.interrupt = False
    seen: list[tuple[int, float]] = []
    train_yolo(
        job, "yolo11s-seg", settings, AUGMENTS["none"], Silent(), lambda n, v: seen.append((n, v))
    )
    asked = [value for what, value in library.calls if what == "train"]
    assert asked[0]["time"] == pytest.approx(0.1)
    assert (asked[0]["lr0"], asked[0]["imgsz"], asked[0]["mosaic"]) == (0.02, 64, 1.0)
    assert asked[1]["resume"] is True
    assert 0 < asked[1]["time"] <= 0.1
    assert [n for n, _ in seen] == [1, 2, 3]
    assert seen[2][1] == pytest.approx(0.2), "masks count where there are any"
    opened = [value for what, value in library.calls if what == "open"]
    assert opened[0] == "yolo11s-seg.yaml"
    assert opened[1].endswith("last.pt")
    model = open_onnx(job.out / "holds.onnx", "cpu", 1)
    assert model.head == "yolo-seg"
    assert model.metadata["base"] == "yolo11s-seg"
    card = (job.out / "holds.md").read_text()
    assert "AGPL-3.0" in card
    assert "discs, made here" in card
    library.calls.clear()
    train_yolo(job, "yolo11s-seg", settings, AUGMENTS["none"], Silent())
    assert not [what for what, _ in library.calls if what == "train"], "what is done stays done"
    with pytest.raises(InputError, match="holds a run of yolo11s-seg"):
        train_yolo(job, "rtdetr-l", settings, AUGMENTS["none"], Silent())


@pytest.mark.usefixtures("library")
def test_pretrained_weights_must_be_there(tmp_path: Path, disc_set: Callable[..., Path]) -> None:
    weights = tmp_path / "yolo11s-seg.pt"
    job = Job((disc_set(tmp_path / "set"),), tmp_path / "run", pretrained=weights)
    settings = YoloSettings(size=64, held_out=0.0)
    with pytest.raises(InputError, match="no such file of pretrained weights"):
        train_yolo(job, "yolo11s-seg", settings, AUGMENTS["none"], Silent())
    weights.write_bytes(b"coco")
    train_yolo(job, "yolo11s-seg", settings, AUGMENTS["none"], Silent())
    assert ("load", str(weights)) in FakeTrainer.calls


@pytest.mark.skipif(importlib.util.find_spec("ultralytics") is not None, reason="installed here")
def test_without_the_extra_it_says_so(tmp_path: Path) -> None:
    job = Job((tmp_path,), tmp_path / "run")
    with pytest.raises(EnvironmentLacksError, match=r"walltopo\[ultralytics\]"):
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
    asked = train_arguments(YoloSettings(), AUGMENTS["none"], tmp_path / "d.yaml", tmp_path)
    zero = ("hsv_h", "hsv_s", "hsv_v", "degrees", "translate", "scale", "flipud", "fliplr")
    assert [asked[key] for key in zero] == [0] * 8
    assert "device" not in asked
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
    with pytest.raises(SettingsError, match="--crop is no setting of --model yolo11s-seg"):
        command.run(parser.parse_args(words))
    with pytest.raises(InputError, match="no network that can be trained"):
        command.run(parser.parse_args(["train", "set", "-o", "x", "--model", "best"]))
