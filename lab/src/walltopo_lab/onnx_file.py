"""Write ONNX files and their metadata."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core.files import atomic_path


def label_export(model: Any, facts: Mapping[str, str]) -> None:
    """Write the metadata of a freshly exported model and remove the exporter's own annotations.

    PyTorch's exporter writes stack traces, which contain local paths, into the nodes.
    """
    import onnx

    onnx.helper.set_model_props(model, dict(facts))
    for node in model.graph.node:
        del node.metadata_props[:]
        node.doc_string = ""


def save_model(model: Any, path: Path, half: bool = True) -> None:
    """Check a model and write it, with float16 weights if `half`."""
    import onnx

    if half:
        model = _store_half(model)
    onnx.checker.check_model(model)
    with atomic_path(path) as temporary:
        onnx.save(model, temporary)


def _store_half(model: Any) -> Any:
    """Store weights as float16 with casts on loading: half the file size, the same arithmetic."""
    import onnx
    from onnx import numpy_helper

    graph = model.graph
    casts = []
    for initializer in graph.initializer:
        array = numpy_helper.to_array(initializer)
        if array.dtype != np.float32 or array.size < 256:
            continue
        name = initializer.name
        half = numpy_helper.from_array(array.astype(np.float16), f"{name}_half")
        initializer.CopyFrom(half)
        casts.append(onnx.helper.make_node("Cast", [half.name], [name], to=onnx.TensorProto.FLOAT))
    for k, node in enumerate(casts):
        graph.node.insert(k, node)
    return model


def set_metadata(path: Path, facts: Mapping[str, str]) -> None:
    """Add or change entries of an ONNX file's metadata."""
    import onnx

    model = onnx.load(path)
    entries = {entry.key: entry.value for entry in model.metadata_props} | dict(facts)
    onnx.helper.set_model_props(model, entries)
    with atomic_path(path) as temporary:
        onnx.save(model, temporary)
