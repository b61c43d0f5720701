"""BlazePose's networks: TFLite files are read, and their ONNX files compute the same."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lab.tests.train.tflite_writer import SmallNetwork, Sparse
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.networks import open_network
from walltopo_lab.train.pose.__main__ import convert_file, detector_bytes, main
from walltopo_lab.train.pose.tflite_file import read_tflite

Floats = NDArray[np.float32]
SAME, VALID = 0, 1
NONE, RELU, RELU6 = 0, 1, 3
SHAPE = (1, 9, 8, 3)


def random(*shape: int) -> Floats:
    return np.random.default_rng(sum(shape)).normal(size=shape).astype(np.float32)


def picture(shape: tuple[int, ...] = SHAPE) -> Floats:
    return np.random.default_rng(5).uniform(-1, 1, shape).astype(np.float32)


def write(network: SmallNetwork, outputs: list[int], folder: Path) -> Path:
    path = folder / "small.tflite"
    path.write_bytes(network.to_bytes([0], outputs))
    return path


def run(path: Path, values: Floats, *outputs: str) -> list[Floats]:
    """Convert a TFLite file, and return its outputs; rank 4 in TFLite's order."""
    out = path.with_suffix(".onnx")
    convert_file(path, out, dict(enumerate(outputs)), "a test")
    session = open_network(out, threads=1).session
    found = session.run(list(outputs), {"pictures": values.transpose(0, 3, 1, 2)})
    return [array.transpose(0, 2, 3, 1) if array.ndim == 4 else array for array in found]


def interpreted(path: Path, values: Floats) -> list[Floats]:
    """Return the outputs that TensorFlow's own interpreter computes."""
    reason = "ai-edge-litert is not installed"
    litert = pytest.importorskip("ai_edge_litert.interpreter", reason=reason)
    interpreter = litert.Interpreter(str(path), num_threads=1)
    interpreter.allocate_tensors()
    interpreter.set_tensor(interpreter.get_input_details()[0]["index"], values)
    interpreter.invoke()
    return [interpreter.get_tensor(each["index"]) for each in interpreter.get_output_details()]


def convolved(
    values: Floats, weights: Floats, bias: Floats, step: int, pads: tuple[int, int]
) -> Floats:
    """Return a convolution in plain loops; weights are (out, height, width, in)."""
    padded = np.pad(values, ((0, 0), pads, pads, (0, 0)))
    out, height, width = weights.shape[:3]
    rows = (padded.shape[1] - height) // step + 1
    columns = (padded.shape[2] - width) // step + 1
    found = np.zeros((1, rows, columns, out), np.float32)
    for y in range(rows):
        for x in range(columns):
            window = padded[0, y * step : y * step + height, x * step : x * step + width]
            found[0, y, x] = (weights * window).sum(axis=(1, 2, 3)) + bias
    return found


def all_operators() -> tuple[SmallNetwork, list[int]]:
    """Return a network with each operator that the converter knows, and its outputs."""
    net = SmallNetwork()
    picture = net.variable(*SHAPE)
    half = net.constant(random(8, 3, 3, 3).astype(np.float16))
    weights = net.operator("DEQUANTIZE", [half], (8, 3, 3, 3))
    bias = net.constant(random(8))
    stride = {"stride_w": 2, "stride_h": 2}
    a = net.operator(
        "CONV_2D",
        [picture, weights, bias],
        (1, 5, 4, 8),
        padding=SAME,
        activation=RELU6,
        dilation_w=1,
        dilation_h=1,
        **stride,
    )
    once = {"stride_w": 1, "stride_h": 1, "dilation_w": 1, "dilation_h": 1}
    depth = [a, net.constant(random(1, 3, 3, 8)), bias]
    b = net.operator(
        "DEPTHWISE_CONV_2D", depth, (1, 5, 4, 8), padding=SAME, activation=RELU, **once
    )
    c = net.operator("ADD", [a, b], (1, 5, 4, 8), activation=NONE)
    pads = net.constant(np.array([[0, 0], [1, 0], [0, 2], [1, 3]], np.int32))
    d = net.operator("PAD", [c, pads], (1, 6, 6, 12))
    size = net.constant(np.array([9, 12], np.int32))
    e = net.operator(
        "RESIZE_BILINEAR", [d, size], (1, 9, 12, 12), align_corners=0, half_pixel_centers=1
    )
    f = net.operator(
        "MAX_POOL_2D", [e], (1, 5, 6, 12), padding=SAME, filter_w=2, filter_h=2, **stride
    )
    g = net.operator("DEPTH_TO_SPACE", [f], (1, 10, 12, 3), block_size=2)
    flat = [
        net.operator("RESHAPE", [k, net.constant(np.array([1, -1, 3], np.int32))], (1, n, 3))
        for k, n in ((g, 120), (net.operator("LOGISTIC", [picture], SHAPE), 72))
    ]
    h = net.operator("CONCATENATION", flat, (1, 192, 3), axis=1, activation=NONE)
    return net, [h, g, c]


@pytest.mark.parametrize(("step", "pads"), [(1, (1, 1)), (2, (1, 1))])
def test_a_convolution_is_that_of_plain_loops(
    tmp_path: Path, step: int, pads: tuple[int, int]
) -> None:
    net = SmallNetwork()
    shape = (1, 9, 9, 3)
    weights, bias = random(4, 3, 3, 3), random(4)
    side = 9 if step == 1 else 5
    options = {"stride_w": step, "stride_h": step, "dilation_w": 1, "dilation_h": 1}
    inputs = [net.variable(*shape), net.constant(weights), net.constant(bias)]
    out = net.operator("CONV_2D", inputs, (1, side, side, 4), padding=SAME, **options)
    (found,) = run(write(net, [out], tmp_path), picture(shape), "maps")
    expected = convolved(picture(shape), weights, bias, step, pads)
    assert found == pytest.approx(expected, abs=2e-3)  # half floats


def test_same_padding_puts_the_odd_pixel_last(tmp_path: Path) -> None:
    net = SmallNetwork()
    shape = (1, 8, 8, 3)
    weights, bias = random(2, 3, 3, 3), random(2)
    inputs = [net.variable(*shape), net.constant(weights), net.constant(bias)]
    options = {"stride_w": 2, "stride_h": 2, "dilation_w": 1, "dilation_h": 1}
    out = net.operator("CONV_2D", inputs, (1, 4, 4, 2), padding=SAME, **options)
    (found,) = run(write(net, [out], tmp_path), picture(shape), "maps")
    assert found == pytest.approx(convolved(picture(shape), weights, bias, 2, (0, 1)), abs=2e-3)


def test_depth_becomes_space_in_the_order_of_tflite(tmp_path: Path) -> None:
    net = SmallNetwork()
    values = picture((1, 2, 3, 8))
    out = net.operator("DEPTH_TO_SPACE", [net.variable(*values.shape)], (1, 4, 6, 2), block_size=2)
    (found,) = run(write(net, [out], tmp_path), values, "maps")
    blocks = values.reshape(1, 2, 3, 2, 2, 2).transpose(0, 1, 3, 2, 4, 5)
    assert found == pytest.approx(blocks.reshape(1, 4, 6, 2))


def test_sparse_weights_become_dense(tmp_path: Path) -> None:
    net = SmallNetwork()
    values = np.array([[1, 2], [3, 4], [5, 6]], np.float16)
    sparse = Sparse(values, segments=[0, 1, 1, 3], columns=[2, 0, 1], shape=(3, 6))
    net.variable(*SHAPE)
    net.operator("DENSIFY", [net.constant(sparse)], (3, 6))
    graph = read_tflite(write(net, [0], tmp_path))
    expected = [[0, 0, 0, 0, 1, 2], [0] * 6, [3, 4, 5, 6, 0, 0]]
    found = graph.tensors[1].value
    assert found is not None
    assert found.tolist() == expected


def test_small_networks_compute_what_litert_computes(tmp_path: Path) -> None:
    net, outputs = all_operators()
    path = write(net, outputs, tmp_path)
    found = run(path, picture(), "rows", "space", "sum")
    assert [array.shape for array in found] == [net.tensors[k][0] for k in outputs]
    for mine, other in zip(found, interpreted(path, picture()), strict=True):
        assert mine == pytest.approx(other, abs=1e-3 * float(np.abs(other).max()))


def test_operators_without_a_wanted_output_are_left_out(tmp_path: Path) -> None:
    net, outputs = all_operators()
    path = write(net, [outputs[2], outputs[0]], tmp_path)
    run(path, picture(), "sum")
    kinds = {node.op_type for node in _onnx_nodes(path.with_suffix(".onnx"))}
    assert "DepthToSpace" not in kinds
    assert "Conv" in kinds


def _onnx_nodes(path: Path) -> Any:
    import onnx

    return onnx.load(path).graph.node


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.tflite"
    with pytest.raises(InputError, match="no such file"):
        read_tflite(path)
    path.write_bytes(b"no network at all")
    with pytest.raises(InputError, match="not a TFLite file"):
        read_tflite(path)
    with pytest.raises(InputError, match="expected one TFLite file"):
        detector_bytes(path)
    with pytest.raises(InputError, match="description of an npm package"):
        main([str(tmp_path), str(tmp_path)])


def test_activations_that_the_converter_lacks_are_refused(tmp_path: Path) -> None:
    net = SmallNetwork()
    picture_ = net.variable(*SHAPE)
    out = net.operator("ADD", [picture_, picture_], SHAPE, activation=4)  # tanh
    path = write(net, [out], tmp_path)
    with pytest.raises(InputError, match=r"small.tflite: ADD with the activation 4"):
        run(path, picture(), "sum")


@pytest.mark.parametrize(
    ("name", "side", "low", "outputs"),
    [
        ("pose_detection", 224, -1.0, {0: "boxes", 1: "scores"}),
        ("pose_landmark_lite", 256, 0.0, {0: "points", 1: "presence", 3: "heatmaps"}),
        ("pose_landmark_full", 256, 0.0, {0: "points", 1: "presence", 3: "heatmaps"}),
        ("pose_landmark_heavy", 256, 0.0, {0: "points", 1: "presence", 3: "heatmaps"}),
    ],
)
def test_blazepose_computes_what_litert_computes(
    tmp_path: Path,
    name: str,
    side: int,
    low: float,
    outputs: dict[int, str],
) -> None:
    folder = os.environ.get("WALLTOPO_POSE_PACKAGE")
    if folder is None:
        pytest.skip("WALLTOPO_POSE_PACKAGE names no unpacked npm package @mediapipe/pose")
    path = Path(folder) / f"{name}.tflite"
    if name == "pose_detection":
        path = tmp_path / path.name
        path.write_bytes(detector_bytes(Path(folder) / "pose_solution_packed_assets.data"))
    out = tmp_path / "pose.onnx"
    convert_file(path, out, outputs, "a test")
    session = open_network(out, threads=1).session
    rng = np.random.default_rng(0)
    noise = rng.uniform(low, 1, (1, side, side, 3)).astype(np.float32)
    smooth = np.repeat(np.repeat(noise[:, ::32, ::32], 32, axis=1), 32, axis=2)
    for values in (noise, smooth):
        expected = interpreted(path, values)
        found = session.run(list(outputs.values()), {"pictures": values.transpose(0, 3, 1, 2)})
        for k, mine in zip(outputs, found, strict=True):
            other = expected[k]
            other = other.transpose(0, 3, 1, 2) if other.ndim == 4 else other
            # A probability is compared on the scale of 1.
            assert mine == pytest.approx(other, abs=1e-3 * max(1.0, float(np.abs(other).max())))
