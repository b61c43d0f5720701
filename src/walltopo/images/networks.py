"""Load an ONNX network and read its metadata."""

from __future__ import annotations

import ast
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import EnvironmentLacksError, InputError


@dataclass(frozen=True, eq=False)
class Network:
    """A loaded network.

    Parameters
    ----------
    path : the file.
    session : `onnxruntime.InferenceSession`.
    metadata : key-value pairs of the file.
    """

    path: Path
    session: Any
    metadata: dict[str, str]

    @cached_property
    def input_shape(self) -> tuple[Any, ...]:
        """Return the shape of the first input; a non-integer entry is dynamic."""
        return tuple(self.session.get_inputs()[0].shape)

    def number(self, key: str, default: float) -> float:
        """Return a number of the metadata."""
        text = self.metadata.get(key)
        if text is None:
            return default
        try:
            return float(text)
        except ValueError as error:
            raise InputError(
                f"{self.path}: metadata {key}: expected a number, got {text!r}"
            ) from error

    def read_numbers(self, key: str, default: list[float]) -> list[float]:
        """Return a JSON list of the metadata with as many numbers as `default`."""
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

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the class names: a JSON list, or `{0: 'hold', 1: 'volume'}` as Ultralytics writes.

        Raises
        ------
        InputError : the names are missing or invalid.
        """
        text = self.metadata.get("names")
        if text is None:
            raise InputError(f"{self.path}: the metadata lack `names`, the class names")
        try:
            listed = json.loads(text) if text.lstrip().startswith("[") else ast.literal_eval(text)
            items = listed.items() if isinstance(listed, dict) else enumerate(listed)
            names = {int(k): str(v) for k, v in items}
        except (ValueError, SyntaxError, AttributeError, TypeError) as error:
            raise InputError(f"{self.path}: metadata names: cannot be read: {text!r}") from error
        if not names or sorted(names) != list(range(len(names))):
            raise InputError(
                f"{self.path}: metadata names: expected classes 0 to n-1, got {text!r}"
            )
        return tuple(names[k] for k in range(len(names)))


def open_network(path: Path, device: str = "cpu", threads: int = 0) -> Network:
    """Load a network.

    Parameters
    ----------
    device : "cpu", "cuda", or "auto" (CUDA if ONNX Runtime supports it).
    threads : threads of one run; 0 = ONNX Runtime's default.

    Raises
    ------
    InputError : the file is missing or not ONNX.
    EnvironmentLacksError : CUDA is requested but not available.
    """
    import onnxruntime

    if not path.is_file():
        raise InputError(f"{path}: no such model file")
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3
    if threads:
        options.intra_op_num_threads = threads
    providers = _execution_providers(device)
    try:
        session = onnxruntime.InferenceSession(str(path), options, providers=providers)
    except Exception as error:  # ONNX Runtime raises its own kinds for broken files
        raise InputError(f"{path}: ONNX Runtime cannot load it ({error})") from error
    return Network(path, session, dict(session.get_modelmeta().custom_metadata_map))


_INTEGER_PRODUCTS = {"AVX512_CLX", "AVX512_ICL", "AVX512_SPR"}  # NumPy's groups with AVX512_VNNI


def has_integer_products() -> bool:
    """Return whether the processor has fast dot products of 8-bit integers (AVX-512 VNNI).

    ONNX Runtime uses such instructions of other processors, too, but nobody measured those.
    """
    found = np.show_config(mode="dicts") or {}
    return not _INTEGER_PRODUCTS.isdisjoint(found.get("SIMD Extensions", {}).get("found", ()))


def runs_on_gpu(device: str) -> bool:
    """Return whether a network on a device ("cpu", "cuda", "auto") runs on a GPU here."""
    import onnxruntime

    return device != "cpu" and "CUDAExecutionProvider" in onnxruntime.get_available_providers()


def _execution_providers(device: str) -> list[str]:
    """Return the execution providers of a device."""
    has_gpu = runs_on_gpu(device)
    if device == "cuda" and not has_gpu:
        raise EnvironmentLacksError(
            "--device cuda is set, but this ONNX Runtime has no CUDA provider",
            "Install onnxruntime-gpu in place of onnxruntime, or use --device cpu.",
        )
    gpu = ["CUDAExecutionProvider"] if has_gpu else []
    return [*gpu, "CPUExecutionProvider"]
