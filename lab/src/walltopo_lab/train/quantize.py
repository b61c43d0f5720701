"""Quantization of an exported detector: 8-bit weights and activations.

Post-training quantization with ONNX Runtime: weights by output channel, activations by tensor,
ranges from photos (Krishnamoorthi, "Quantizing deep convolutional networks for efficient
inference", 2018). Some convolutions stay in float32: the last one before each output, because votes
span three orders of magnitude, and the first three, which cause half of the error. Processors with
dot products of 8-bit integers run the result in less than half of the time; on others it is slower
than float32, and less accurate.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.segment.detect.onnx_detector import prepare
from walltopo.segment.settings import DetectSettings
from walltopo_lab.onnx_file import label_export, save_model
from walltopo_lab.train.cache import open_cache

_FIRST = 3  # the stem, and the first block's convolutions
_QUANTIZED = ("Conv", "Add", "Clip", "Relu", "MaxPool", "Concat", "Resize")


def quantize(model: Path, inputs: Iterator[NDArray[np.uint8]], out: Path) -> None:
    """Write a quantized copy of an exported network, with the same metadata.

    Parameters
    ----------
    inputs : (1, H, W, 3) uint8 RGB inputs of the network, from training photos. The range of an
        activation covers all of them.
    out : file to write.
    """
    import onnx
    from onnxruntime.quantization import QuantFormat, QuantType, quantize_static
    from onnxruntime.quantization.shape_inference import quant_pre_process

    metadata = {entry.key: entry.value for entry in onnx.load(model).metadata_props}
    with tempfile.TemporaryDirectory() as folder:
        plain, quantized = Path(folder) / "float32.onnx", Path(folder) / "int8.onnx"
        # The symbolic inference of shapes does not know the sizes of the exporter's inputs.
        quant_pre_process(model, plain, skip_symbolic_shape=True)
        quantize_static(
            plain,
            quantized,
            _Calibration(inputs),
            quant_format=QuantFormat.QDQ,
            per_channel=True,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            op_types_to_quantize=list(_QUANTIZED),
            nodes_to_exclude=_convolutions_in_float(onnx.load(plain).graph),
        )
        result = onnx.load(quantized)
    label_export(result, metadata)
    save_model(result, out, half=False)


def calibration_inputs(
    photos: Sequence[tuple[Path, str]], settings: DetectSettings
) -> Iterator[NDArray[np.uint8]]:
    """Yield the input of each cached photo, in turn of the detector's first and second pass.

    Parameters
    ----------
    photos : cache folder and name of each.
    """
    for k, (folder, name) in enumerate(photos):
        photo = open_cache(folder, name).rgb()
        size = settings.size * (settings.again if k % 2 else 1.0)
        yield prepare(photo, size / max(photo.shape[:2]))[None]


class _Calibration:
    """A `CalibrationDataReader` of ONNX Runtime: the inputs one by one, then None."""

    def __init__(self, inputs: Iterator[NDArray[np.uint8]]) -> None:
        self._inputs = inputs

    def get_next(self) -> dict[str, NDArray[np.uint8]] | None:
        """Return the next input by its name, or None after the last."""
        photo = next(self._inputs, None)
        return None if photo is None else {"photo": photo}


def _convolutions_in_float(graph: Any) -> list[str]:
    """Return the names of a graph's first convolutions, and of the last before each output."""
    maker = {name: node for node in graph.node for name in node.output}
    names = [node.name for node in graph.node if node.op_type == "Conv"][:_FIRST]
    for output in graph.output:
        node = maker[output.name]
        while node.op_type != "Conv":
            node = maker[node.input[0]]
        names.append(node.name)
    return names
