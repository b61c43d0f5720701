"""The network that finds people: one class of YOLOX, for pictures of any size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from walltopo.images.networks import open_network
from walltopo_lab.train.people import main

SIDE, CLASSES = 64, 80


def small_yolox() -> onnx.ModelProto:
    """Return a network with the names and the output of YOLOX, of one layer."""
    rng = np.random.default_rng(0)
    counts = {"head.reg_preds.0.weight": 5, "head.cls_preds.0.weight": CLASSES}
    arrays = {
        name: rng.normal(size=(count, 3, 32, 32)).astype(np.float32) / 3e4
        for name, count in counts.items()
    }
    convolve = [
        helper.make_node("Conv", ["images", name], [name[5:8]], strides=[32, 32]) for name in arrays
    ]
    nodes = [
        *convolve,
        helper.make_node("Concat", ["reg", "cls"], ["both"], axis=1),
        helper.make_node("Shape", ["both"], ["sizes"], start=0, end=2),
        helper.make_node("Concat", ["sizes", "rest"], ["rows"], axis=0),
        helper.make_node("Reshape", ["both", "rows"], ["flat"]),
        helper.make_node("Transpose", ["flat"], ["output"], perm=[0, 2, 1]),
    ]
    arrays["rest"] = np.array([-1], dtype=np.int64)
    graph = helper.make_graph(
        nodes,
        "yolox",
        [helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, SIDE, SIDE])],
        [helper.make_tensor_value_info("output", TensorProto.FLOAT, [1, 4, 5 + CLASSES])],
        [numpy_helper.from_array(array, name) for name, array in arrays.items()],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def test_people_remain_as_they_were(tmp_path: Path) -> None:
    onnx.save(small_yolox(), tmp_path / "whole.onnx")
    assert main([str(tmp_path / "whole.onnx"), str(tmp_path / "people.onnx")]) == 0
    whole, people = (
        open_network(tmp_path / name, threads=1).session for name in ("whole.onnx", "people.onnx")
    )
    picture = np.random.default_rng(1).uniform(0, 255, (1, 3, SIDE, SIDE)).astype(np.float32)
    (expected,) = whole.run(None, {"images": picture})
    (found,) = people.run(None, {"images": picture})
    assert found == pytest.approx(expected[..., :6], abs=2e-3)
    wide = np.concatenate([picture, picture], axis=3)
    (both,) = people.run(None, {"images": wide})
    assert both.shape == (1, 8, 6)
    assert both[0, :2] == pytest.approx(found[0, :2], abs=1e-4)
