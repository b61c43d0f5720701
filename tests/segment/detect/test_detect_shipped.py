"""The shipped network, from photo to COCO file."""

from __future__ import annotations

import colorsys
import json
from dataclasses import replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import pytest

from walltopo.core import EnvironmentLacksError, InputError, Silent
from walltopo.images import networks
from walltopo.images.files import read_rgb
from walltopo.images.networks import open_network
from walltopo.pipeline.runner import run_stage
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import Photo, PhotoList
from walltopo.segment.detect.detector import open_detector, shipped_model, shipped_quantized
from walltopo.segment.detect.onnx_detector import OnnxDetector, prepare
from walltopo.segment.detect.photo_detections import box_iou
from walltopo.segment.detect.photos import detect_photos, photos_in
from walltopo.segment.settings import DetectSettings


def painted_wall(width: int = 640, height: int = 480) -> np.ndarray:
    """A grey wall with a dozen coloured blobs, RGB."""
    rng = np.random.default_rng(1)
    wall = np.full((height, width, 3), (170, 165, 158), np.uint8)
    for k in range(12):
        middle = (80 + 160 * (k % 4), 90 + 150 * (k // 4))
        rgb = colorsys.hsv_to_rgb(k / 12, 0.86, 0.78)
        colour = tuple(round(255 * v) for v in rgb)
        cv2.ellipse(wall, middle, (30, 20), 20 * k, 0, 360, colour, -1, cv2.LINE_AA)
    noise = rng.normal(0, 4, wall.shape)
    return np.clip(wall + noise, 0, 255).astype(np.uint8)


@pytest.fixture(scope="module", params=["float", "int8"])
def detector(request: pytest.FixtureRequest) -> OnnxDetector:
    settings = DetectSettings(size=640, threads=1, precision=request.param)
    found = open_detector(settings)
    assert isinstance(found, OnnxDetector)
    return found


@pytest.mark.parametrize(
    ("precision", "found", "gpu", "file"),
    [
        ("auto", ["X86_V3", "AVX512_ICL"], False, "holds-int8.onnx"),
        ("auto", ["X86_V3"], False, "holds.onnx"),
        ("auto", ["X86_V3", "AVX512_ICL"], True, "holds.onnx"),
        ("float", ["X86_V3", "AVX512_ICL"], False, "holds.onnx"),
        ("int8", ["ASIMDHP"], False, "holds-int8.onnx"),
    ],
)
def test_the_quantized_network_runs_where_it_is_faster(
    precision: Literal["auto", "float", "int8"],
    found: list[str],
    gpu: bool,
    file: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(np, "show_config", lambda mode: {"SIMD Extensions": {"found": found}})
    monkeypatch.setattr(networks, "runs_on_gpu", lambda device: gpu)
    monkeypatch.setattr(networks, "_execution_providers", lambda device: ["CPUExecutionProvider"])
    detector = open_detector(DetectSettings(precision=precision))
    assert isinstance(detector, OnnxDetector)
    assert detector.model.path.name == file


def test_the_quantized_network_is_made_of_the_shipped_one() -> None:
    plain, quantized = (
        open_network(path).metadata for path in (shipped_model(), shipped_quantized())
    )
    calibrated = {"scores", "offset"}
    assert plain.keys() == quantized.keys()
    assert {k: v for k, v in plain.items() if k not in calibrated} == {
        k: v for k, v in quantized.items() if k not in calibrated
    }


def test_metadata_say_how_to_use_it(detector: OnnxDetector) -> None:
    assert detector.classes == {1: "hold", 2: "volume"}
    assert detector.model.head == "votes"
    assert set(detector.thresholds) == {1, 2}
    assert all(0.05 <= score <= 0.9 for score in detector.thresholds.values())
    assert shipped_model().stat().st_size < 11e6


def test_blobs_on_a_wall_are_holds(detector: OnnxDetector) -> None:
    found = detector.detect(painted_wall())
    middles = [(80 + 160 * (k % 4), 90 + 150 * (k // 4)) for k in range(12)]
    hit = sum(any(m.full()[y, x] for m in found.masks if m.area < 5000) for x, y in middles)
    assert hit >= 10


def test_least_scores_are_by_class_and_boxes_are_moved(
    detector: OnnxDetector, monkeypatch: pytest.MonkeyPatch
) -> None:
    photo = painted_wall()
    settings = DetectSettings(size=640, threads=1, again=0.0)
    plain = OnnxDetector(shipped_model(), settings)
    holds = plain.detect(photo)
    label = int(np.bincount(holds.labels).argmax())  # flat blobs may be holds or volumes
    assert all(s >= plain.thresholds[k] for s, k in zip(holds.scores, holds.labels, strict=True))
    scores = [0.999 if k == label else 0.05 for k in (1, 2)]
    moved = {**plain.model.metadata, "offset": "[4.0, -2.0]", "scores": json.dumps(scores)}
    monkeypatch.setattr(plain, "model", replace(plain.model, metadata=moved))
    plain.thresholds = plain._thresholds()
    assert not (plain.detect(photo).labels == label).any()
    monkeypatch.setattr(plain, "thresholds", OnnxDetector(shipped_model(), settings).thresholds)
    offset = detector.model.read_numbers("offset", [0.0, 0.0])
    shift = np.median(holds.boxes - plain.detect(photo).boxes, axis=0)
    np.testing.assert_allclose(shift[:2], np.subtract([4.0, -2.0], offset), atol=0.3)
    with pytest.raises(InputError, match="expected 2 numbers"):
        replace(plain.model, metadata={"offset": "[1.0]"}).read_numbers("offset", [0.0, 0.0])
    with pytest.raises(InputError, match="not a list of numbers"):
        replace(plain.model, metadata={"offset": "left"}).read_numbers("offset", [0.0, 0.0])


def test_tiles_find_what_the_whole_photo_finds(detector: OnnxDetector) -> None:
    photo = painted_wall()
    whole = detector.detect(photo)
    settings = DetectSettings(size=640, tile=384, overlap=128, threads=1)
    tiled = OnnxDetector(shipped_model(), settings).detect(photo)
    met = box_iou(whole.boxes, tiled.boxes).max(axis=1) > 0.6
    assert met.mean() > 0.8
    assert abs(len(whole) - len(tiled)) <= 0.25 * len(whole) + 1


def test_stage_writes_coco_in_photo_pixels(tmp_path: Path) -> None:
    scan = ScanFolder(tmp_path)
    scan.photos.mkdir()
    cv2.imwrite(str(scan.photos / "a.jpg"), painted_wall()[..., ::-1])
    cv2.imwrite(str(scan.photos / "b.png"), np.full((90, 120, 3), 128, np.uint8))
    sizes = {"a.jpg": (640, 480), "b.png": (120, 90)}
    photos = tuple(Photo(name, *size, None, name, 100.0) for name, size in sizes.items())
    PhotoList(photos=photos).save(scan.photo_list)
    figures = run_stage(scan, "detect", DetectSettings(size=640, threads=1))
    found = Detections.load(scan.detections)
    assert found.classes == {1: "hold", 2: "volume"}
    assert found.sizes == sizes
    assert set(found.masks) == set(sizes)
    assert figures["masks"] == sum(len(m) for m in found.masks.values()) > 0
    assert {(m.width, m.height) for m in found.masks["a.jpg"]} == {(640, 480)}


def test_drawings(tmp_path: Path, detector: OnnxDetector) -> None:
    photo = tmp_path / "wall.png"
    cv2.imwrite(str(photo), painted_wall()[..., ::-1])
    detect_photos([photo], detector, Silent(), tmp_path / "pictures")
    drawn = read_rgb(tmp_path / "pictures" / "wall.png")
    assert drawn.shape == (480, 640, 3)
    assert (drawn != read_rgb(photo)).any()


def test_photo_is_padded_not_stretched() -> None:
    photo = np.full((100, 130, 3), 200, np.uint8)
    canvas = prepare(photo, 0.5)
    assert canvas.shape == (64, 96, 3)
    assert (canvas[:50, :65] == 200).all()
    assert canvas[50:].max() == 0


def test_errors_name_the_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="neither a known detector"):
        open_detector(DetectSettings(model="yolo99"))
    with pytest.raises(InputError, match="no such model file"):
        open_detector(DetectSettings(model=str(tmp_path / "x.onnx")))
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"not a network")
    with pytest.raises(InputError, match=r"broken\.onnx"):
        open_detector(DetectSettings(model=str(broken)))
    (tmp_path / "photos").mkdir()
    with pytest.raises(InputError, match="photos"):
        photos_in(tmp_path / "photos")
    PhotoList(photos=(Photo("gone.jpg", 640, 480, None, "gone.jpg", 1.0),)).save(
        ScanFolder(tmp_path).photo_list
    )
    with pytest.raises(InputError, match=r"gone\.jpg"):
        run_stage(ScanFolder(tmp_path), "detect", DetectSettings())


def test_cuda_is_not_silently_replaced() -> None:
    import onnxruntime

    if "CUDAExecutionProvider" in onnxruntime.get_available_providers():
        pytest.skip("this machine has CUDA")
    with pytest.raises(EnvironmentLacksError, match="no CUDA provider"):
        open_detector(DetectSettings(device="cuda"))


@pytest.mark.data
def test_real_photo_of_a_dense_wall(data_root: Path) -> None:
    photo = read_rgb(data_root / "spraywall" / "photos" / "IMG_8992.jpg")
    height, width = photo.shape[:2]
    rows = np.loadtxt(data_root / "spraywall" / "labels" / "IMG_8992.txt")
    middle, size = rows[:, 1:3] * [width, height], rows[:, 3:5] * [width, height]
    boxes = np.concatenate([middle - size / 2, middle + size / 2], axis=1)
    found = OnnxDetector(shipped_model(), DetectSettings(threads=1)).detect(photo)
    assert (box_iou(boxes, found.boxes).max(axis=1) >= 0.5).mean() > 0.5
