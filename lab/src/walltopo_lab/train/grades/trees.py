"""Export of fitted gradient boosting as an ONNX tree ensemble."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper
from sklearn.ensemble import HistGradientBoostingRegressor


def as_onnx(model: HistGradientBoostingRegressor, features: int) -> onnx.ModelProto:
    """Return a model from (N, features) float32, NaN allowed, to (N, 1) float32.

    Its values equal the original's to float32 accuracy. Thresholds are rounded down to float32, so
    that every comparison of a float32 input has the same result.
    """
    nodes: dict[str, list[Any]] = {name: [] for name in _NODES}
    leaves: dict[str, list[Any]] = {name: [] for name in _LEAVES}
    for tree, (predictor,) in enumerate(model._predictors):
        for k, node in enumerate(predictor.nodes):
            leaf = bool(node["is_leaf"])
            threshold = 0.0 if leaf else _down(float(node["num_threshold"]))
            _put(
                nodes,
                nodes_treeids=tree,
                nodes_nodeids=k,
                nodes_featureids=0 if leaf else int(node["feature_idx"]),
                nodes_values=threshold,
                nodes_modes="LEAF" if leaf else "BRANCH_LEQ",
                nodes_truenodeids=0 if leaf else int(node["left"]),
                nodes_falsenodeids=0 if leaf else int(node["right"]),
                nodes_missing_value_tracks_true=0 if leaf else int(node["missing_go_to_left"]),
            )
            if leaf:
                _put(
                    leaves,
                    target_treeids=tree,
                    target_nodeids=k,
                    target_ids=0,
                    target_weights=float(node["value"]),
                )
    base = float(np.ravel(model._baseline_prediction)[0])
    ensemble = helper.make_node(
        "TreeEnsembleRegressor",
        ["features"],
        ["place"],
        domain="ai.onnx.ml",
        n_targets=1,
        base_values=[base],
        post_transform="NONE",
        **nodes,
        **leaves,
    )
    graph = helper.make_graph(
        [ensemble],
        "grades",
        [helper.make_tensor_value_info("features", TensorProto.FLOAT, [None, features])],
        [helper.make_tensor_value_info("place", TensorProto.FLOAT, [None, 1])],
    )
    opsets = [helper.make_opsetid("", 17), helper.make_opsetid("ai.onnx.ml", 3)]
    return helper.make_model(graph, opset_imports=opsets, ir_version=8)


_NODES = (
    "nodes_treeids",
    "nodes_nodeids",
    "nodes_featureids",
    "nodes_values",
    "nodes_modes",
    "nodes_truenodeids",
    "nodes_falsenodeids",
    "nodes_missing_value_tracks_true",
)
_LEAVES = ("target_treeids", "target_nodeids", "target_ids", "target_weights")


def _put(columns: dict[str, list[Any]], **values: Any) -> None:
    for name, value in values.items():
        columns[name].append(value)


def _down(value: float) -> float:
    single = np.float32(value)
    if float(single) > value:
        single = np.nextafter(single, np.float32(-np.inf))
    return float(single)
