"""Fused attention computes what the operators that it replaces compute."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import TensorProto, helper

from walltopo_lab.train.attention import fuse_attention

WIDTH = 8
HEADS = 4


def inputs(n: int, m: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    return {
        name: rng.normal(size=(1, HEADS, count, WIDTH)).astype(np.float32)
        for name, count in (("q", n), ("k", m), ("v", m), ("w", n))
    }


def network(nodes: list[Any], outputs: list[str]) -> Any:
    """A network of the inputs q, w of n rows and k, v of m rows."""
    float_ = TensorProto.FLOAT
    graph = helper.make_graph(
        nodes,
        "attention",
        [
            helper.make_tensor_value_info(k, float_, [1, HEADS, n, WIDTH])
            for k, n in zip("qkvw", "nmmn", strict=True)
        ],
        [
            helper.make_tensor_value_info(name, float_, [1, HEADS, f"of {name}", WIDTH])
            for name in outputs
        ],
        [helper.make_tensor("root", float_, [1], [WIDTH**-0.25])],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 20)], ir_version=10)


def one_way() -> Any:
    return network(
        [
            helper.make_node("Transpose", ["k"], ["turned"], perm=[0, 1, 3, 2]),
            helper.make_node("Mul", ["q", "root"], ["q_scaled"]),
            helper.make_node("Mul", ["turned", "root"], ["k_scaled"]),
            helper.make_node("MatMul", ["q_scaled", "k_scaled"], ["scores"]),
            helper.make_node("Softmax", ["scores"], ["shares"], axis=-1),
            helper.make_node("MatMul", ["shares", "v"], ["found"]),
        ],
        ["found"],
    )


def both_ways() -> Any:
    swap = {"perm": [0, 1, 3, 2]}
    return network(
        [
            helper.make_node("Einsum", ["q", "k"], ["s"], equation="bhid, bhjd -> bhij"),
            helper.make_node("Softmax", ["s"], ["there"], axis=-1),
            helper.make_node("Transpose", ["s"], ["s_back"], **swap),
            helper.make_node("Softmax", ["s_back"], ["back"], axis=-1),
            helper.make_node("Einsum", ["there", "v"], ["to_k"], equation="bhij, bhjd -> bhid"),
            helper.make_node("Transpose", ["back"], ["back_turned"], **swap),
            helper.make_node(
                "Einsum", ["back_turned", "w"], ["to_q"], equation="bhji, bhjd -> bhid"
            ),
        ],
        ["to_k", "to_q"],
    )


def run(model: Any, values: dict[str, np.ndarray]) -> list[np.ndarray]:
    names = {one.name for one in model.graph.input}
    session = onnxruntime.InferenceSession(model.SerializeToString())
    return session.run(None, {name: values[name] for name in names})


@pytest.mark.parametrize(("make", "count"), [(one_way, 1), (both_ways, 2)])
@pytest.mark.parametrize(("n", "m"), [(5, 9), (300, 1), (1, 700)])
def test_the_result_stays(make: Any, count: int, n: int, m: int) -> None:
    plain, fused = make(), make()
    assert fuse_attention(fused) == count
    onnx.checker.check_model(fused)
    assert not {"Softmax", "Einsum", "MatMul"} & {node.op_type for node in fused.graph.node}
    values = inputs(n, m)
    for expected, found in zip(run(plain, values), run(fused, values), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_softmax_without_attention_stays() -> None:
    model = network([helper.make_node("Softmax", ["q"], ["found"], axis=-1)], ["found"])
    assert fuse_attention(model) == 0
    assert [node.op_type for node in model.graph.node] == ["Softmax"]
