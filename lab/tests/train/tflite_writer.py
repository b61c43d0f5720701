"""Write small TFLite files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import flatbuffers
import numpy as np
from numpy.typing import NDArray

from walltopo_lab.train.pose.tflite_file import OPERATORS, OPTIONS

_CODES = {name: code for code, name in OPERATORS.items()}
_TYPES = {"float32": 0, "float16": 1, "int32": 2}
# TFLite's `BuiltinOptions`, the type of an operator's options.
_UNION = {
    "CONV_2D": 1,
    "DEPTHWISE_CONV_2D": 2,
    "MAX_POOL_2D": 5,
    "CONCATENATION": 10,
    "ADD": 11,
    "RESIZE_BILINEAR": 15,
    "RESHAPE": 17,
    "PAD": 22,
    "DEQUANTIZE": 38,
    "DEPTH_TO_SPACE": 94,
    "DENSIFY": 0,
    "LOGISTIC": 0,
}


@dataclass(frozen=True)
class Sparse:
    """A matrix as rows of a dense axis and columns of a sparse one, in blocks of columns."""

    values: NDArray[Any]  # (n, block)
    segments: list[int]
    columns: list[int]
    shape: tuple[int, int]


@dataclass
class SmallNetwork:
    """A network under construction; tensors and operators are in the order of their addition."""

    tensors: list[tuple[tuple[int, ...], Any]] = field(default_factory=list)
    operators: list[tuple[str, list[int], int, Mapping[str, int]]] = field(default_factory=list)

    def variable(self, *shape: int) -> int:
        """Add a tensor whose value the network computes; return its number."""
        self.tensors.append((shape, None))
        return len(self.tensors) - 1

    def constant(self, value: Any) -> int:
        """Add a constant; return its number."""
        self.tensors.append((value.shape, value))
        return len(self.tensors) - 1

    def operator(self, kind: str, inputs: list[int], shape: Sequence[int], **options: int) -> int:
        """Add an operator; return the number of its output, which has this shape."""
        output = self.variable(*shape)
        self.operators.append((kind, inputs, output, options))
        return output

    def to_bytes(self, inputs: list[int], outputs: list[int]) -> bytes:
        """Return the TFLite file."""
        builder = flatbuffers.Builder(1024)
        kinds = sorted({kind for kind, *_ in self.operators})
        codes = [
            _table(builder, {0: ("Int8", _CODES[kind]), 3: ("Int32", _CODES[kind])})
            for kind in kinds
        ]
        empty = _table(builder, {})
        buffers, tensors = [empty], []
        for number, (shape, value) in enumerate(self.tensors):
            tensors.append(_tensor(builder, number, shape, value, buffers))
        operators = [_operator(builder, kinds, *operator) for operator in self.operators]
        graph = _table(
            builder,
            {
                0: ("offset", _vector(builder, tensors)),
                1: ("offset", builder.CreateNumpyVector(np.array(inputs, np.int32))),
                2: ("offset", builder.CreateNumpyVector(np.array(outputs, np.int32))),
                3: ("offset", _vector(builder, operators)),
            },
        )
        model = _table(
            builder,
            {
                0: ("Uint32", 3),
                1: ("offset", _vector(builder, codes)),
                2: ("offset", _vector(builder, [graph])),
                4: ("offset", _vector(builder, buffers)),
            },
        )
        builder.Finish(model, b"TFL3")
        return bytes(builder.Output())


def _table(builder: Any, slots: Mapping[int, tuple[str, Any]]) -> int:
    builder.StartObject(max(slots, default=-1) + 1)
    for slot, (kind, value) in slots.items():
        if kind == "offset":
            builder.PrependUOffsetTRelativeSlot(slot, value, 0)
        else:
            getattr(builder, f"Prepend{kind}Slot")(slot, value, None)
    return int(builder.EndObject())


def _vector(builder: Any, tables: Sequence[int]) -> int:
    builder.StartVector(4, len(tables), 4)
    for table in reversed(tables):
        builder.PrependUOffsetTRelative(table)
    return int(builder.EndVector())


def _tensor(
    builder: Any, number: int, shape: tuple[int, ...], value: Any, buffers: list[int]
) -> int:
    dense = value.values if isinstance(value, Sparse) else value
    slots: dict[int, tuple[str, Any]] = {
        0: ("offset", builder.CreateNumpyVector(np.array(shape, np.int32))),
        3: ("offset", builder.CreateString(f"tensor{number}")),
    }
    if isinstance(value, Sparse):
        slots[6] = ("offset", _sparsity(builder, value))
    if dense is not None:
        data = builder.CreateNumpyVector(np.frombuffer(dense.tobytes(), np.uint8))
        slots[1] = ("Int8", _TYPES[str(dense.dtype)])
        slots[2] = ("Uint32", len(buffers))
        buffers.append(_table(builder, {0: ("offset", data)}))
    return _table(builder, slots)


def _sparsity(builder: Any, value: Sparse) -> int:
    segments, columns = (
        _table(builder, {0: ("offset", builder.CreateNumpyVector(np.array(list_, np.uint8)))})
        for list_ in (value.segments, value.columns)
    )
    levels = [
        _table(builder, {0: ("Int8", 0), 1: ("Int32", value.shape[0])}),
        _table(
            builder,
            {
                0: ("Int8", 1),
                2: ("Uint8", 3),
                3: ("offset", segments),
                4: ("Uint8", 3),
                5: ("offset", columns),
            },
        ),
        _table(builder, {0: ("Int8", 0), 1: ("Int32", value.values.shape[1])}),
    ]
    return _table(
        builder,
        {
            0: ("offset", builder.CreateNumpyVector(np.array([0, 1, 2], np.int32))),
            1: ("offset", builder.CreateNumpyVector(np.array([1], np.int32))),
            2: ("offset", _vector(builder, levels)),
        },
    )


def _operator(
    builder: Any,
    kinds: list[str],
    kind: str,
    inputs: list[int],
    output: int,
    options: Mapping[str, int],
) -> int:
    places = OPTIONS.get(kind, {})
    slots = {places[name][0]: (places[name][1], value) for name, value in options.items()}
    table: dict[int, tuple[str, Any]] = {
        0: ("Uint32", kinds.index(kind)),
        1: ("offset", builder.CreateNumpyVector(np.array(inputs, np.int32))),
        2: ("offset", builder.CreateNumpyVector(np.array([output], np.int32))),
    }
    if _UNION[kind]:
        table[3] = ("Uint8", _UNION[kind])
        table[4] = ("offset", _table(builder, slots))
    return _table(builder, table)
