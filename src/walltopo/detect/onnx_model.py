"""A detector's ONNX file: how its outputs are read, and its classes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from walltopo.core import InputError
from walltopo.inference.session import Network, open_network

__all__ = ["OnnxModel", "open_onnx"]

_OUTPUTS = {"votes": 3, "yolo-seg": 2, "yolo-det": 1, "rtdetr": 1}


@dataclass(frozen=True, eq=False)
class OnnxModel(Network):
    """A loaded detector.

    Parameters
    ----------
    head : how its outputs are read: `votes`, `yolo-seg`, `yolo-det` or `rtdetr`.
    classes : class names by label (>= 1): walltopo's own begin with hold 1, volume 2.
    size : (height, width) of the input in pixels, None where it is free.
    many : whether it takes several photos at once.
    """

    head: str
    classes: dict[int, str]
    size: tuple[int, int] | None
    many: bool


def open_onnx(path: Path, device: str, threads: int) -> OnnxModel:
    """Load a detector.

    Raises
    ------
    InputError : as `open_network`, or metadata that do not say how to read it.
    EnvironmentLacksError : CUDA was asked for and is absent.
    """
    network = open_network(path, device, threads)
    head = _head_of(network)
    classes = dict(enumerate(network.names, start=1))
    shape = network.input_shape
    rows, cols = (shape[1], shape[2]) if head == "votes" else (shape[2], shape[3])
    fixed = (rows, cols) if isinstance(rows, int) and isinstance(cols, int) else None
    many = not isinstance(shape[0], int)
    return OnnxModel(path, network.session, network.metadata, head, classes, fixed, many)


def _head_of(network: Network) -> str:
    """What kind of outputs a file has: from its metadata, else from Ultralytics' habits."""
    metadata = network.metadata
    # Ultralytics has begun to write a `head` of its own (the name of its last layer).
    if metadata.get("head") == "votes":
        head = "votes"
    elif metadata.get("task") == "segment":
        head = "yolo-seg"
    elif metadata.get("task") == "detect":
        rtdetr = "rtdetr" in metadata.get("description", "").lower().replace("-", "")
        head = "rtdetr" if rtdetr else "yolo-det"
    else:
        raise InputError(
            f"{network.path}: the metadata do not say what it answers (`head`, `task`); "
            f"found {sorted(metadata)}",
            "Export with `walltopo train` or with Ultralytics (format=onnx), which write them.",
        )
    outputs = len(network.session.get_outputs())
    if outputs != _OUTPUTS[head]:
        raise InputError(
            f"{network.path}: a {head} network has {_OUTPUTS[head]} outputs, "
            f"this file has {outputs}"
        )
    return head
