"""The parts of ALIKED that are written anew for its export."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")

import onnxruntime  # noqa: E402

from walltopo_lab.train import larger_features as larger  # noqa: E402


def test_the_deformable_convolution_is_that_of_onnx() -> None:
    rng = np.random.default_rng(0)
    photo = rng.normal(size=(1, 5, 9, 12)).astype(np.float32)
    weight = rng.normal(size=(7, 5, 3, 3)).astype(np.float32)
    offsets = rng.normal(0, 2, (1, 18, 9, 12)).astype(np.float32)
    tensor = onnx.helper.make_tensor_value_info
    arrays = {"x": photo, "w": weight, "o": offsets}
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node("DeformConv", list(arrays), ["y"], pads=[1, 1, 1, 1])],
        "deform",
        [tensor(name, onnx.TensorProto.FLOAT, one.shape) for name, one in arrays.items()],
        [tensor("y", onnx.TensorProto.FLOAT, None)],
    )
    model = onnx.helper.make_model(
        graph, opset_imports=[onnx.helper.make_opsetid("", 19)], ir_version=9
    )
    try:
        session = onnxruntime.InferenceSession(model.SerializeToString())
    except Exception as error:  # ONNX Runtime raises its own kinds
        pytest.skip(f"this ONNX Runtime has no DeformConv ({error})")
    found = larger.deformable_convolution(*map(torch.tensor, (photo, offsets, weight)))
    np.testing.assert_allclose(found.numpy(), session.run(None, arrays)[0], atol=1e-3)


def test_the_strongest_points_lie_between_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    y, x = np.mgrid[:40, :50]
    scores = np.zeros((40, 50))
    for at_x, at_y, height in ((12.3, 20.0, 0.9), (30.0, 8.6, 0.6)):
        scores += height * np.exp(-((x - at_x) ** 2 + (y - at_y) ** 2) / 4)
    monkeypatch.setattr(larger, "_POINTS", 2)
    points, best = larger.strongest(torch.tensor(scores, dtype=torch.float32))
    np.testing.assert_allclose(points.numpy(), [[12.3, 20.0], [30.0, 8.6]], atol=0.3)
    assert best[0] > best[1] > 0.5


def test_points_count_as_found_with_the_same_descriptor() -> None:
    points, unit = np.array([[1.0, 1.0], [9.0, 9.0]]), np.eye(2)
    scores = np.ones(2)
    same = points[::-1] + 0.1, scores, unit[::-1]
    swapped = points, scores, unit[::-1]
    assert larger.share_without_counterpart(same, (points, scores, unit)) == 0
    assert larger.share_without_counterpart(swapped, (points, scores, unit)) == 1
