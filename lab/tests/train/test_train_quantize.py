"""Quantization of an exported detector."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest
from lab.tests.train.networks import SMALL, trained_norms
from numpy.typing import NDArray

from walltopo.images.networks import open_network
from walltopo_lab.train.export import export_onnx
from walltopo_lab.train.net import VoteNet
from walltopo_lab.train.quantize import quantize


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return an exported small network and its quantized copy."""
    folder = tmp_path_factory.mktemp("quantize")
    plain, quantized = folder / "plain.onnx", folder / "int8.onnx"
    export_onnx(trained_norms(VoteNet(SMALL)), plain, {"version": "step 7"})
    quantize(plain, iter([noise(k) for k in range(4)]), quantized)
    return plain, quantized


def noise(seed: int) -> NDArray[np.uint8]:
    """Return a (1, 96, 128, 3) input."""
    return np.random.default_rng(seed).integers(0, 256, (1, 96, 128, 3), dtype=np.uint8)


def test_the_first_and_the_last_convolutions_keep_float_weights(files: tuple[Path, Path]) -> None:
    graph = onnx.load(files[1]).graph
    kinds = {tensor.name: tensor.data_type for tensor in graph.initializer}
    makers = {name: node for node in graph.node for name in node.output}
    convolutions = [node for node in graph.node if node.op_type == "Conv"]
    plain = [node for node in convolutions if node.input[1] not in makers]
    assert len(plain) == 3 + 3
    assert len(convolutions) > 20
    for node in convolutions:
        if node not in plain:
            weights = makers[node.input[1]]
            assert weights.op_type == "DequantizeLinear"
            assert kinds[weights.input[0]] == onnx.TensorProto.INT8


def test_a_quantized_network_answers_nearly_the_same(files: tuple[Path, Path]) -> None:
    plain, quantized = (open_network(path, threads=1) for path in files)
    assert quantized.metadata == plain.metadata
    for expected, found in zip(
        plain.session.run(None, {"photo": noise(9)}),
        quantized.session.run(None, {"photo": noise(9)}),
        strict=True,
    ):
        assert found.shape == expected.shape
        spread = float(np.std(expected))
        assert float(np.sqrt(np.mean((found - expected) ** 2))) < 0.3 * spread
