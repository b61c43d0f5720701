"""An ONNX file with what its metadata says about it."""

from __future__ import annotations

import ast
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walltopo.core import EnvironmentLacksError, InputError

__all__ = ["OnnxModel", "open_onnx", "parse_classes"]


@dataclass(frozen=True, eq=False)
class OnnxModel:
    """A loaded network.

    Parameters
    ----------
    path : the file.
    session : `onnxruntime.InferenceSession`.
    head : how its outputs are read: `votes`, `yolo-seg`, `yolo-det` or `rtdetr`.
    classes : class names by label (>= 1).
    size : (height, width) of the input in pixels, None where it is free.
    many : whether it takes several photos at once.
    metadata : the file's own key-value pairs.
    """

    path: Path
    session: Any
    head: str
    classes: dict[int, str]
    size: tuple[int, int] | None
    many: bool
    metadata: dict[str, str]

    def number(self, key: str, default: float) -> float:
        """A number from the metadata."""
        text = self.metadata.get(key)
        if text is None:
            return default
        try:
            return float(text)
        except ValueError as error:
            raise InputError(
                f"{self.path}: metadata {key}: expected a number, got {text!r}"
            ) from error

    def numbers(self, key: str, default: list[float]) -> list[float]:
        """A JSON list of as many numbers as `default` has, from the metadata."""
        text = self.metadata.get(key)
        if text is None:
            return default
        try:
            values = [float(value) for value in json.loads(text)]
        except (ValueError, TypeError) as error:
            raise InputError(f"{self.path}: metadata {key}: not a list of numbers: {text!r}") from (
                error
            )
        if len(values) != len(default):
            raise InputError(
                f"{self.path}: metadata {key}: expected {len(default)} numbers, got {text!r}"
            )
        return values


def parse_classes(text: str, path: Path) -> dict[int, str]:
    """Class names by label from `{0: 'hold', 1: 'volume'}` (Ultralytics) or a JSON list.

    Names known to walltopo take its labels (hold 1, volume 2); others count on from 1.
    """
    try:
        names = json.loads(text) if text.lstrip().startswith("[") else ast.literal_eval(text)
        items = names.items() if isinstance(names, dict) else enumerate(names)
        listed = {int(k): str(v) for k, v in items}
    except (ValueError, SyntaxError, AttributeError, TypeError) as error:
        raise InputError(f"{path}: metadata names: cannot be read: {text!r}") from error
    if not listed or sorted(listed) != list(range(len(listed))):
        raise InputError(f"{path}: metadata names: expected classes 0 to n-1, got {text!r}")
    return {k + 1: v for k, v in sorted(listed.items())}


def _providers(device: str) -> list[str]:
    import onnxruntime

    available = onnxruntime.get_available_providers()
    has_gpu = "CUDAExecutionProvider" in available
    if device == "cuda" and not has_gpu:
        raise EnvironmentLacksError(
            "detect.device is cuda, but this ONNX Runtime has no CUDA provider",
            "Install onnxruntime-gpu in place of onnxruntime, or use --device cpu.",
        )
    gpu = ["CUDAExecutionProvider"] if has_gpu and device != "cpu" else []
    return [*gpu, "CPUExecutionProvider"]


def _head_of(metadata: dict[str, str], outputs: list[Any], path: Path) -> str:
    """What kind of outputs a file has: from its metadata, else from Ultralytics' habits."""
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
            f"{path}: the metadata do not say what it answers (`head`, `task`); "
            f"found {sorted(metadata)}",
            "Export with `walltopo train` or with Ultralytics (format=onnx), which write them.",
        )
    wanted = {"votes": 3, "yolo-seg": 2, "yolo-det": 1, "rtdetr": 1}
    if len(outputs) != wanted[head]:
        raise InputError(
            f"{path}: a {head} network has {wanted[head]} outputs, this file has {len(outputs)}"
        )
    return head


def open_onnx(path: Path, device: str, threads: int) -> OnnxModel:
    """Load a network.

    Raises
    ------
    InputError : no such file, no ONNX file, or metadata that do not say how to read it.
    EnvironmentLacksError : CUDA was asked for and is absent.
    """
    import onnxruntime

    if not path.is_file():
        raise InputError(f"{path}: no such model file")
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3
    if threads:
        options.intra_op_num_threads = threads
    providers = _providers(device)
    try:
        session = onnxruntime.InferenceSession(str(path), options, providers=providers)
    except Exception as error:  # ONNX Runtime raises its own kinds for broken files
        raise InputError(f"{path}: ONNX Runtime cannot load it ({error})") from error
    metadata = dict(session.get_modelmeta().custom_metadata_map)
    head = _head_of(metadata, session.get_outputs(), path)
    if "names" not in metadata:
        raise InputError(f"{path}: the metadata lack `names`, the class names")
    shape = session.get_inputs()[0].shape
    rows, cols = (shape[1], shape[2]) if head == "votes" else (shape[2], shape[3])
    fixed = (rows, cols) if isinstance(rows, int) and isinstance(cols, int) else None
    classes = parse_classes(metadata["names"], path)
    return OnnxModel(path, session, head, classes, fixed, not isinstance(shape[0], int), metadata)
