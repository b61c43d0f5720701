"""The Ultralytics families with Ultralytics itself, and fetched weights."""

from __future__ import annotations

import functools
import hashlib
import http.server
import importlib.util
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.core import EnvironmentLacksError, InputError, Silent
from walltopo.segment.detect.detector import open_detector
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.settings import DetectSettings
from walltopo_lab.detectors.fetch import SAM_WEIGHTS, Weights, cache_folder, fetch

PHOTO = np.random.default_rng(0).integers(0, 255, (80, 100, 3), dtype=np.uint8)


@pytest.fixture(scope="session")
def eager(ultralytics: Any, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Weights that nobody trained, and that are sure of whatever they see."""
    folder = tmp_path_factory.mktemp("weights")

    def make(name: str) -> Path:
        path = folder / f"{name}.pt"
        if not path.is_file():
            rtdetr = name.startswith("rtdetr")
            network = (ultralytics.RTDETR if rtdetr else ultralytics.YOLO)(f"{name}.yaml")
            head = network.model.model[-1]
            last = head.dec_score_head if rtdetr else [branch[-1] for branch in head.cv3]
            for layer in last:
                layer.bias.data[0] += 12.0
            network.save(str(path))
        return path

    return make


@pytest.fixture(scope="session")
def mobile_sam(ultralytics: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Segment Anything with random weights, where the real ones would be kept."""
    import torch
    from ultralytics.models.sam.build import build_mobile_sam

    path = tmp_path_factory.mktemp("cache") / "mobile_sam.pt"
    torch.manual_seed(0)
    sam = build_mobile_sam()
    sam.mask_decoder.iou_prediction_head.layers[-1].bias.data += 1.0  # it thinks well of its masks
    torch.save(sam.state_dict(), path)
    return path


def check(found: PhotoDetections) -> None:
    """Boxes and masks lie in the photo and belong together."""
    height, width = PHOTO.shape[:2]
    assert (found.width, found.height) == (width, height)
    assert len(found) > 0
    assert len(found.masks) == len(found.scores) == len(found.labels) == len(found)
    assert (found.boxes[:, :2] >= 0).all()
    assert (found.boxes[:, 2:] <= [width, height]).all()
    for mask, label in zip(found.masks, found.labels, strict=True):
        assert mask.area > 0
        assert mask.x + mask.bitmap.shape[1] <= width
        assert mask.y + mask.bitmap.shape[0] <= height
        assert mask.label == label


def test_own_masks_of_a_network(eager: Callable[[str], Path]) -> None:
    weights = str(eager("yolo11n-seg"))
    detector = open_detector(DetectSettings(model="yolo11-seg", weights=weights, size=128))
    assert detector.classes[1] == "0"  # unnamed classes of fresh weights
    check(detector.detect(PHOTO))


def test_boxes_of_an_rtdetr(eager: Callable[[str], Path]) -> None:
    from walltopo_lab.detectors.families import UltralyticsDetector

    weights = eager("rtdetr-l")
    check(UltralyticsDetector(weights, DetectSettings(size=128), rtdetr=True).detect(PHOTO))


def test_masks_by_sam(
    eager: Callable[[str], Path], mobile_sam: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WALLTOPO_CACHE", str(mobile_sam.parent))
    settings = DetectSettings(model="yolo11-sam", weights=str(eager("yolo11n")), size=128)
    detector = open_detector(settings)
    assert "SAM" in detector.description
    check(detector.detect(PHOTO))


def test_sam_answers_for_each_box_and_takes_points_of_a_known_shape(mobile_sam: Path) -> None:
    from walltopo_lab.detectors.families import SamMasks

    boxes = np.array([[0.0, 0, 20, 10], [40, 40, 60, 60]])
    points = np.array([[[10.0, 5], [4, 4]], [[50, 50], [45, 45]]])
    sam = SamMasks(mobile_sam)
    scores, labels = np.array([0.9, 0.8]), np.array([1, 2])
    plain = sam.look(PHOTO, boxes, scores, labels)
    output = sam.look(PHOTO, boxes, scores, labels, points)
    assert len(plain) == len(output) == 2
    whole = sam.masks(PHOTO, boxes, scores, labels)  # an ellipse where SAM has none
    assert [mask.label for mask in whole] == [1, 2]
    for mask, (x0, y0, x1, y1) in zip(whole, boxes, strict=True):
        # A tenth more than the box, at most.
        assert x0 - 2 <= mask.x
        assert y0 - 2 <= mask.y
        assert mask.x + mask.bitmap.shape[1] <= x1 + 2
        assert mask.y + mask.bitmap.shape[0] <= y1 + 2
    assert sam.look(PHOTO, boxes[:0], scores[:0], labels[:0]) == []


def test_labels_are_refined_by_sam_or_kept(
    mobile_sam: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from walltopo.core import Mask
    from walltopo_lab.cli.dataset import _sam

    monkeypatch.setenv("WALLTOPO_CACHE", str(mobile_sam.parent))
    masks = [
        Mask(np.ones((20, 20), bool), 40, 40, 100, 80, 1, 1.0),
        Mask(np.ones((20, 20), bool), 10, 40, 100, 80, 2, 1.0),
    ]
    refined = _sam("mobile-sam")(PHOTO, masks, [True, False])
    assert [mask.label for mask in refined] == [1, 2]
    for mask, given in zip(refined, masks, strict=True):
        both = mask.full() & given.full()
        assert both.sum() / (mask.area + given.area - both.sum()) >= 0.35


@pytest.mark.usefixtures("ultralytics")
def test_weights_must_be_named() -> None:
    with pytest.raises(InputError, match="weights"):
        open_detector(DetectSettings(model="yolo11-seg"))
    with pytest.raises(InputError, match="gone"):
        open_detector(DetectSettings(model="yolo11-seg", weights="gone.pt"))


@pytest.mark.skipif(importlib.util.find_spec("ultralytics") is not None, reason="installed here")
def test_without_the_extra_it_says_how_to_get_it() -> None:
    with pytest.raises(EnvironmentLacksError, match=r"walltopo-lab"):
        open_detector(DetectSettings(model="yolo11-sam", weights="x.pt"))


CONTENT = bytes(range(256)) * 9000


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *args: Any) -> None: ...


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    (tmp_path / "served").mkdir()
    (tmp_path / "served" / "w.pt").write_bytes(CONTENT)
    handler = functools.partial(Quiet, directory=str(tmp_path / "served"))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as httpd:
        threading.Thread(target=httpd.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{httpd.server_address[1]}"
        httpd.shutdown()


def test_fetched_once_and_checked(server: str, tmp_path: Path) -> None:
    wanted = Weights("w.pt", f"{server}/w.pt", hashlib.sha256(CONTENT).hexdigest())
    path = fetch(wanted, Silent(), tmp_path / "cache")
    assert path.read_bytes() == CONTENT
    (tmp_path / "served" / "w.pt").unlink()
    assert fetch(wanted, Silent(), tmp_path / "cache") == path


def test_other_content_is_not_kept(server: str, tmp_path: Path) -> None:
    wanted = Weights("w.pt", f"{server}/w.pt", "0" * 64)
    with pytest.raises(InputError, match="expected"):
        fetch(wanted, Silent(), tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_offline_says_what_to_put_where(tmp_path: Path) -> None:
    wanted = Weights("w.pt", "http://127.0.0.1:9/w.pt", "0" * 64)
    with pytest.raises(EnvironmentLacksError) as caught:
        fetch(wanted, Silent(), tmp_path / "cache")
    assert "http://127.0.0.1:9/w.pt" in str(caught.value)
    assert str(tmp_path / "cache" / "w.pt") in str(caught.value)


def test_cache_follows_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("WALLTOPO_CACHE", str(tmp_path))
    assert cache_folder() == tmp_path
    monkeypatch.delenv("WALLTOPO_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", "/x")
    assert cache_folder() == Path("/x/walltopo")


def test_all_weights_are_pinned() -> None:
    for weights in SAM_WEIGHTS.values():
        assert weights.address.startswith("https://")
        assert len(weights.sha256) == 64
