"""The Ultralytics families: adapters against an imitation, and fetched weights."""

from __future__ import annotations

import functools
import hashlib
import http.server
import importlib.util
import sys
import threading
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.core import EnvironmentLacksError, InputError, Silent
from walltopo.detect.contract import DetectSettings
from walltopo.detect.detector import open_detector
from walltopo_lab.detectors.fetch import SAM_WEIGHTS, Weights, cache_folder, fetch


class Values:
    """Stands for a tensor."""

    def __init__(self, values: Any) -> None:
        self._values = np.asarray(values)

    def cpu(self) -> np.ndarray:
        return self._values


class FakeNetwork:
    """Sees one 20 px box at (10, 10) of every picture, and says which pictures it saw."""

    def __init__(self, weights: str) -> None:
        self.names = {0: "hold", 1: "volume"}
        self.shapes: list[tuple[int, ...]] = []

    def predict(self, photo: np.ndarray, **options: Any) -> list[Any]:
        self.shapes.append(photo.shape)
        boxes = types.SimpleNamespace(
            xyxy=Values([[10.0, 10, 30, 30], [11, 10, 31, 30]]),
            conf=Values([0.9, 0.5]),
            cls=Values([1.0, 1]),
        )
        bitmaps = np.zeros((2, *photo.shape[:2]))
        bitmaps[:, 12:28, 14:26] = 1
        return [
            types.SimpleNamespace(boxes=boxes, masks=types.SimpleNamespace(data=Values(bitmaps)))
        ]


class FakeSam:
    """Fills the left half of every box; has nothing for boxes left of x = 5."""

    told: dict[str, Any] = {}  # noqa: RUF012

    def __init__(self, weights: str) -> None: ...

    def __call__(self, photo: np.ndarray, bboxes: list[list[float]], **options: Any) -> list[Any]:
        FakeSam.told = options
        bitmaps = np.zeros((len(bboxes), *photo.shape[:2]))
        for k, (x0, y0, x1, y1) in enumerate(bboxes):
            if x0 >= 5:
                bitmaps[k, int(y0) : int(y1), int(x0) : int((x0 + x1) / 2)] = 1
        return [types.SimpleNamespace(masks=types.SimpleNamespace(data=Values(bitmaps)))]


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> None:
    module = types.ModuleType("ultralytics")
    module.YOLO = module.RTDETR = FakeNetwork  # type: ignore[attr-defined]
    module.SAM = FakeSam  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "ultralytics", module)


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    path = tmp_path / "ours.pt"
    path.write_bytes(b"")
    return path


@pytest.mark.usefixtures("library")
def test_own_masks_of_a_network(weights: Path) -> None:
    detector = open_detector(DetectSettings(model="yolo11-seg", weights=str(weights), size=128))
    found = detector.detect(np.zeros((80, 100, 3), np.uint8))
    assert detector.classes == {1: "hold", 2: "volume"}
    assert len(found) == 1, "the weaker box of the same object goes"
    assert found.masks[0].box == (14, 12, 12, 16)
    assert found.labels.tolist() == [2]


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize("model", ["yolo11-sam", "rtdetr-sam"])
def test_masks_by_sam(
    model: str, weights: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WALLTOPO_CACHE", str(tmp_path))
    (tmp_path / "mobile_sam.pt").write_bytes(b"")
    detector = open_detector(DetectSettings(model=model, weights=str(weights), size=128))
    found = detector.detect(np.zeros((80, 100, 3), np.uint8))
    assert found.masks[0].box == (10, 10, 10, 20)
    assert "SAM" in detector.description


@pytest.mark.usefixtures("library")
def test_where_sam_sees_nothing_the_ellipse_stays() -> None:
    from walltopo_lab.detectors.families import SamMasks

    boxes = np.array([[0.0, 0, 20, 10], [40, 40, 60, 60]])
    masks = SamMasks(Path("mobile_sam.pt")).masks(
        np.zeros((80, 100, 3), np.uint8), boxes, np.array([0.9, 0.8]), np.array([1, 1])
    )
    assert masks[0].box == (0, 0, 20, 10)
    assert masks[1].box == (40, 40, 10, 20)


@pytest.mark.usefixtures("library")
def test_sam_is_told_points_of_a_known_shape_and_says_when_it_sees_nothing() -> None:
    from walltopo_lab.detectors.families import SamMasks

    boxes = np.array([[0.0, 0, 20, 10], [40, 40, 60, 60]])
    points = np.array([[[10.0, 5], [4, 4]], [[50, 50], [45, 45]]])
    sam, photo = SamMasks(Path("mobile_sam.pt")), np.zeros((80, 100, 3), np.uint8)
    scores, labels = np.array([0.9, 0.8]), np.array([1, 1])
    nothing, half = sam.look(photo, boxes, scores, labels, points)
    assert nothing is None
    assert half is not None
    assert half.box == (40, 40, 10, 20)
    assert FakeSam.told["points"] == points.tolist()
    assert FakeSam.told["labels"] == [[1, 1], [1, 1]]
    sam.look(photo, boxes, scores, labels)
    assert "points" not in FakeSam.told
    assert sam.look(photo, boxes[:0], scores[:0], labels[:0]) == []


@pytest.mark.usefixtures("library")
def test_refining_labels_by_sam(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A shape's points are told, a box's are not; disagreement keeps the label."""
    from walltopo.core import Mask
    from walltopo_lab.cli.dataset import _sam

    monkeypatch.setenv("WALLTOPO_CACHE", str(tmp_path))
    (tmp_path / "sam2.1_t.pt").write_bytes(b"")
    masks = [
        Mask(np.ones((20, 20), bool), 40, 40, 100, 80, 1, 1.0),
        Mask(np.ones((20, 20), bool), 10, 40, 100, 80, 2, 1.0),
    ]
    refine = _sam("sam2.1-t")
    asked: list[dict[str, Any]] = []
    photo = np.zeros((80, 100, 3), np.uint8)
    monkeypatch.setattr(FakeSam, "__call__", spy(FakeSam.__call__, asked), raising=True)
    box, shape = refine(photo, masks, [True, False])
    assert (box.box, shape.box) == ((40, 40, 10, 20), (10, 40, 10, 20))
    assert (box.label, shape.label) == (1, 2)
    assert ["points" in options for options in asked] == [False, True]
    (told,) = asked[1]["points"]
    assert told[0] == pytest.approx([20, 50], abs=1)


def spy(function: Any, seen: list[dict[str, Any]]) -> Any:
    def called(*args: Any, **options: Any) -> Any:
        seen.append(options)
        return function(*args, **options)

    return called


@pytest.mark.usefixtures("library")
def test_weights_must_be_named() -> None:
    with pytest.raises(InputError, match="needs weights trained on holds, and none are named"):
        open_detector(DetectSettings(model="yolo11-seg"))
    with pytest.raises(InputError, match=r"gone\.pt does not exist"):
        open_detector(DetectSettings(model="yolo11-seg", weights="gone.pt"))


@pytest.mark.skipif(importlib.util.find_spec("ultralytics") is not None, reason="installed here")
def test_without_the_extra_it_says_how_to_get_it() -> None:
    with pytest.raises(EnvironmentLacksError, match=r"walltopo\[ultralytics\]"):
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
    with pytest.raises(InputError, match="expected 000"):
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
