"""Metadata of ONNX files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

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


def set_metadata(path: Path, facts: Mapping[str, str]) -> None:
    """Add or change entries of an ONNX file's metadata."""
    import onnx

    model = onnx.load(path)
    entries = {entry.key: entry.value for entry in model.metadata_props} | dict(facts)
    onnx.helper.set_model_props(model, entries)
    with atomic_path(path) as temporary:
        onnx.save(model, temporary)
