"""Replace the attention of an ONNX network by ONNX Runtime's operator, which is faster.

The operator works through the scores of n queries and m keys in blocks, and never writes all n
times m of them to memory.
"""

from __future__ import annotations

from typing import Any

import numpy as np

_AXIS = "axis_of_batch"


def fuse_attention(model: Any) -> int:
    """Replace, in place, softmax(a q k^T) v of one batch by `MultiHeadAttention`.

    The factor a may stand at q and at k. Products may be `MatMul` or, in attention from one set to
    another and back, `Einsum`, where the scores of the way back are those of the way there,
    transposed.

    Parameters
    ----------
    model : `onnx.ModelProto` with queries, keys and values of shape (1, heads, n, d).

    Returns
    -------
    Number of attentions replaced.
    """
    from onnx import TensorProto, helper, numpy_helper

    graph = model.graph
    maker = {name: node for node in graph.node for name in node.output}
    user = {name: node for node in graph.node for name in node.input}
    numbers = {one.name: numpy_helper.to_array(one) for one in graph.initializer}
    fused: dict[str, list[Any]] = {}
    for softmax in [node for node in graph.node if node.op_type == "Softmax"]:
        scores, product = maker.get(softmax.input[0]), user.get(softmax.output[0])
        if scores is None or product is None:
            continue
        factor = 1.0
        if scores.op_type == "MatMul":
            scaled = [maker[name] for name in scores.input]
            queries, keys = scaled[0].input[0], _before_transposition(maker, scaled[1].input[0])
            factor = float(np.prod([numbers[node.input[1]] for node in scaled]))
        elif scores.op_type == "Einsum":
            queries, keys = scores.input
        elif scores.op_type == "Transpose":
            keys, queries = maker[scores.input[0]].input
            product = user[product.output[0]]
        else:
            continue  # no attention
        result = product.output[0]
        fused[result] = _fused_attention(queries, keys, product.input[1], result, factor)
    if fused:
        graph.initializer.append(helper.make_tensor(_AXIS, TensorProto.INT64, [1], [0]))
        _replace_nodes(graph, fused)
        model.opset_import.append(helper.make_opsetid("com.microsoft", 1))
    return len(fused)


def _before_transposition(maker: dict[str, Any], name: str) -> str:
    """Return the name of the tensor that `Transpose` and `Reshape` turned into another."""
    while name in maker and maker[name].op_type in ("Transpose", "Reshape"):
        name = maker[name].input[0]
    return name


def _fused_attention(queries: str, keys: str, values: str, result: str, factor: float) -> list[Any]:
    """Return the nodes of one attention; its heads are a batch to the operator."""
    from onnx import helper

    sources = {"queries": queries, "keys": keys, "values": values}
    flat = {role: f"{result}_{role}" for role in sources}
    return [
        *(helper.make_node("Squeeze", [sources[k], _AXIS], [flat[k]]) for k in sources),
        helper.make_node(
            "MultiHeadAttention",
            list(flat.values()),
            [f"{result}_flat"],
            domain="com.microsoft",
            num_heads=1,
            scale=factor,
        ),
        helper.make_node("Unsqueeze", [f"{result}_flat", _AXIS], [result]),
    ]


def _replace_nodes(graph: Any, nodes: dict[str, list[Any]]) -> None:
    """Replace the nodes that make some tensors, and drop what nothing needs any more."""
    every = []
    for node in graph.node:
        every += nodes.get(node.output[0], [node])
    needed = {output.name for output in graph.output}
    kept = []
    for node in reversed(every):
        if needed & set(node.output):
            kept.append(node)
            needed |= set(node.input)
    initializers = [one for one in graph.initializer if one.name in needed]
    del graph.node[:], graph.initializer[:]
    graph.node.extend(reversed(kept))
    graph.initializer.extend(initializers)
