"""Exports of Ultralytics, imitated: networks whose outputs are known constants."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.segment.detect.detector import open_detector
from walltopo.segment.detect.yolo import box_masks, decode_rtdetr, decode_yolo, letterbox
from walltopo.segment.settings import DetectSettings

onnx = pytest.importorskip("onnx")
NAMES = "{0: 'hold', 1: 'volume'}"


def raw(objects: list[tuple[float, float, float, float, int, float]], extra: int = 0) -> np.ndarray:
    """YOLO's raw output (4 + 2 + extra, 40) of x, y, w, h, class, score."""
    output = np.zeros((6 + extra, 40), np.float32)
    for k, (x, y, w, h, label, score) in enumerate(objects):
        output[:4, k] = x, y, w, h
        output[3 + label, k] = score
    return output


def save_constant(
    path: Path, outputs: list[np.ndarray], side: int | str, metadata: dict[str, str]
) -> Path:
    """An ONNX file that answers every photo with the same outputs."""
    helper, numpy_helper = onnx.helper, onnx.numpy_helper
    nodes, results = [], []
    for k, value in enumerate(outputs):
        tensor = numpy_helper.from_array(value[None].astype(np.float32), f"value{k}")
        nodes.append(helper.make_node("Constant", [], [f"output{k}"], value=tensor))
        results.append(helper.make_tensor_value_info(f"output{k}", 1, [1, *value.shape]))
    photo = helper.make_tensor_value_info("images", 1, [1, 3, side, side])
    graph = helper.make_graph(nodes, "constant", [photo], results)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    for key, text in metadata.items():
        entry = model.metadata_props.add()
        entry.key, entry.value = key, text
    onnx.save(model, path)
    return path


def test_boxes_become_ellipses_in_photo_pixels(tmp_path: Path) -> None:
    output = raw([(100, 80, 40, 20, 1, 0.9), (104, 80, 40, 20, 1, 0.6), (300, 200, 60, 60, 2, 0.7)])
    meta = {"task": "detect", "names": NAMES, "description": "Ultralytics YOLO11n model"}
    path = save_constant(tmp_path / "boxes.onnx", [output], "side", meta)
    detector = open_detector(DetectSettings(model=str(path), size=640))
    found = detector.detect(np.zeros((240, 320, 3), np.uint8))
    assert found.labels.tolist() == [1, 2], "the second box of the same hold is suppressed"
    np.testing.assert_allclose(found.boxes, [[40, 35, 60, 45], [135, 85, 165, 115]])
    assert found.masks[1].area == pytest.approx(np.pi * 15**2, rel=0.05)


def test_prototypes_are_cropped_to_the_box(tmp_path: Path) -> None:
    output = raw([(64, 64, 40, 40, 1, 0.9), (128, 64, 20, 20, 2, 0.8)], extra=2)
    output[6, 0], output[7, 1] = 1.0, 1.0
    prototypes = np.full((2, 40, 40), -5.0, np.float32)
    prototypes[0, 14:18, :] = 5.0  # a band through the first box, and beyond it
    prototypes[1] = 5.0
    meta = {"task": "segment", "names": NAMES}
    path = save_constant(tmp_path / "masks.onnx", [output, prototypes], 160, meta)
    found = open_detector(DetectSettings(model=str(path), size=160)).detect(
        np.zeros((160, 160, 3), np.uint8)
    )
    band, square = found.masks
    assert band.box == (44, 56, 40, 16)
    assert square.box == (118, 54, 20, 20)
    assert square.area == 400


def test_rows_after_nms_are_read_too() -> None:
    rows = np.zeros((300, 6), np.float32)
    rows[0] = 10, 20, 30, 50, 0.8, 1
    found = decode_yolo(rows, None, 2, 0.25, 0.5, (200, 200))
    np.testing.assert_allclose(found.boxes, [[20, 40, 60, 100]])
    assert found.labels.tolist() == [2]


def test_rtdetr_sees_the_photo_stretched(tmp_path: Path) -> None:
    rows = np.zeros((300, 6), np.float32)
    rows[0] = 0.5, 0.25, 0.1, 0.2, 0.9, 0.1
    meta = {"task": "detect", "names": NAMES, "description": "Ultralytics RT-DETR model"}
    path = save_constant(tmp_path / "rtdetr.onnx", [rows], 640, meta)
    detector = open_detector(DetectSettings(model=str(path), size=640))
    found = detector.detect(np.zeros((200, 400, 3), np.uint8))
    np.testing.assert_allclose(found.boxes, [[180, 30, 220, 70]])
    assert len(decode_rtdetr(rows, 2, 0.95, (400, 200))) == 0


def test_photos_larger_than_a_fixed_input_are_tiled(tmp_path: Path) -> None:
    output = raw([(80, 80, 20, 20, 1, 0.9)])
    path = save_constant(tmp_path / "fixed.onnx", [output], 160, {"task": "detect", "names": NAMES})
    settings = DetectSettings(model=str(path), size=512, overlap=16)
    found = open_detector(settings).detect(np.zeros((160, 512, 3), np.uint8))
    assert len(found) == 4
    assert np.ptp(found.boxes[:, 0]) > 300


def test_letterbox_keeps_the_photo_in_the_top_left() -> None:
    values = letterbox(np.full((50, 100, 3), 255, np.uint8), 0.5, 32, 64)
    assert values.shape == (1, 3, 32, 64)
    assert values[0, :, :25, :50].min() == 1.0
    np.testing.assert_allclose(values[0, :, 25:], 114 / 255)


def test_an_ellipse_touches_its_box() -> None:
    (mask,) = box_masks(np.array([[10.0, 20, 50, 40]]), np.array([0.5]), np.array([1]), (100, 100))
    assert mask.box == (10, 20, 40, 20)
    tight = mask.full()
    assert tight[30, 10]
    assert tight[20, 30]
    assert not tight[20, 10]


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({"names": NAMES}, "do not name the output format"),
        ({"task": "detect"}, "lack `names`"),
        ({"task": "segment", "names": NAMES}, "has 2 outputs, this file has 1"),
        ({"head": "Pose", "task": "pose", "names": NAMES}, "do not name the output format"),
    ],
)
def test_files_that_do_not_say_what_they_are(
    tmp_path: Path, metadata: dict[str, str], message: str
) -> None:
    path = save_constant(tmp_path / "odd.onnx", [raw([])], 160, metadata)
    with pytest.raises(InputError, match=message):
        open_detector(DetectSettings(model=str(path)))


def test_outputs_of_another_number_of_classes_are_refused() -> None:
    with pytest.raises(InputError, match="expected 7 rows for 3 classes"):
        decode_yolo(raw([]), None, 3, 0.2, 1.0, (100, 100))
    with pytest.raises(InputError, match="RT-DETR output"):
        decode_rtdetr(np.zeros((10, 7), np.float32), 2, 0.2, (100, 100))
