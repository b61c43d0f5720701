"""Read TFLite files: tensors, constants and operators of networks of floats.

The reader knows the slots of TFLite's schema (github.com/tensorflow/tensorflow,
`lite/schema/schema.fbs`) and needs the package `flatbuffers` alone, which ONNX Runtime installs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError

IDENTIFIER = b"TFL3"  # at byte 4 of each file
_DTYPES = {0: np.float32, 1: np.float16, 2: np.int32}  # by TensorType
OPERATORS = {
    0: "ADD",
    2: "CONCATENATION",
    3: "CONV_2D",
    4: "DEPTHWISE_CONV_2D",
    5: "DEPTH_TO_SPACE",
    6: "DEQUANTIZE",
    14: "LOGISTIC",
    17: "MAX_POOL_2D",
    22: "RESHAPE",
    23: "RESIZE_BILINEAR",
    34: "PAD",
    124: "DENSIFY",
}
# Options of operators: name to slot, type and default.
_Slots = dict[str, tuple[int, str, int]]
_STRIDES: _Slots = {
    "padding": (0, "Int8", 0),
    "stride_w": (1, "Int32", 0),
    "stride_h": (2, "Int32", 0),
}
OPTIONS: Mapping[str, _Slots] = {
    "ADD": {"activation": (0, "Int8", 0)},
    "CONCATENATION": {"axis": (0, "Int32", 0), "activation": (1, "Int8", 0)},
    "CONV_2D": _STRIDES
    | {
        "activation": (3, "Int8", 0),
        "dilation_w": (4, "Int32", 1),
        "dilation_h": (5, "Int32", 1),
    },
    "DEPTHWISE_CONV_2D": _STRIDES
    | {
        "activation": (4, "Int8", 0),
        "dilation_w": (5, "Int32", 1),
        "dilation_h": (6, "Int32", 1),
    },
    "DEPTH_TO_SPACE": {"block_size": (0, "Int32", 0)},
    "MAX_POOL_2D": _STRIDES
    | {
        "filter_w": (3, "Int32", 0),
        "filter_h": (4, "Int32", 0),
        "activation": (5, "Int8", 0),
    },
    "RESIZE_BILINEAR": {"align_corners": (2, "Bool", 0), "half_pixel_centers": (3, "Bool", 0)},
}


@dataclass(frozen=True, eq=False)
class Tensor:
    """A tensor: its shape as in the file (NHWC), and its value if it is a constant."""

    name: str
    shape: tuple[int, ...]
    value: NDArray[Any] | None = None


@dataclass(frozen=True)
class Operator:
    """An operator: numbers of its input and output tensors (-1: absent), and its options."""

    kind: str
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]
    options: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True, eq=False)
class TfliteGraph:
    """A network: operators in the order of execution."""

    tensors: tuple[Tensor, ...]
    operators: tuple[Operator, ...]
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]


class _Table:
    """A flatbuffers table, read by slot."""

    def __init__(self, table: Any) -> None:
        self._table = table

    @classmethod
    def root(cls, data: bytes) -> _Table:
        from flatbuffers.encode import Get
        from flatbuffers.packer import uoffset
        from flatbuffers.table import Table

        return cls(Table(data, Get(uoffset, data, 0)))

    def _offset(self, slot: int) -> int:
        return int(self._table.Offset(4 + 2 * slot))

    def number(self, slot: int, kind: str = "Int32", default: int = 0) -> int:
        """Return a number; `kind` names a type of `flatbuffers.number_types`."""
        from flatbuffers import number_types

        flags = getattr(number_types, f"{kind}Flags")
        place = self._offset(slot)
        return int(self._table.Get(flags, place + self._table.Pos)) if place else default

    def text(self, slot: int) -> str:
        place = self._offset(slot)
        return self._table.String(place + self._table.Pos).decode() if place else ""

    def table(self, slot: int) -> _Table | None:
        from flatbuffers.table import Table

        place = self._offset(slot)
        if not place:
            return None
        return _Table(Table(self._table.Bytes, self._table.Indirect(place + self._table.Pos)))

    def union(self, slot: int) -> _Table | None:
        from flatbuffers.table import Table

        place = self._offset(slot)
        if not place:
            return None
        member = Table(self._table.Bytes, 0)
        self._table.Union(member, place)
        return _Table(member)

    def tables(self, slot: int) -> list[_Table]:
        from flatbuffers.table import Table

        place = self._offset(slot)
        if not place:
            return []
        start = self._table.Vector(place)
        places = [start + 4 * k for k in range(self._table.VectorLen(place))]
        return [_Table(Table(self._table.Bytes, self._table.Indirect(at))) for at in places]

    def array(self, slot: int, dtype: Any = np.int32) -> NDArray[Any]:
        place = self._offset(slot)
        if not place:
            return np.zeros(0, dtype)
        count = self._table.VectorLen(place)
        return np.frombuffer(self._table.Bytes, dtype, count, self._table.Vector(place))


def read_tflite(path: Path) -> TfliteGraph:
    """Return the network of a TFLite file.

    Raises
    ------
    InputError : the file is missing, is not TFLite, or has operators that this reader lacks.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    data = path.read_bytes()
    if data[4:8] != IDENTIFIER:
        raise InputError(f"{path}: not a TFLite file")
    model = _Table.root(data)
    buffers, graphs = model.tables(4), model.tables(2)
    if len(graphs) != 1:
        raise InputError(f"{path}: {len(graphs)} graphs; expected one")
    kinds = [_kind(path, code) for code in model.tables(1)]
    return TfliteGraph(
        tuple(_tensor(path, table, buffers) for table in graphs[0].tables(0)),
        tuple(_operator(table, kinds) for table in graphs[0].tables(3)),
        tuple(graphs[0].array(1).tolist()),
        tuple(graphs[0].array(2).tolist()),
    )


def _kind(path: Path, code: _Table) -> str:
    # Old files have the first number, new ones both; the larger one is right.
    number = max(code.number(0, "Int8"), code.number(3))
    if number not in OPERATORS:
        raise InputError(f"{path}: operator {number} of TFLite's schema is not supported")
    return OPERATORS[number]


def _operator(table: _Table, kinds: list[str]) -> Operator:
    kind = kinds[table.number(0, "Uint32")]
    options = table.union(4)
    values = {
        name: default if options is None else options.number(slot, form, default)
        for name, (slot, form, default) in OPTIONS.get(kind, {}).items()
    }
    inputs, outputs = (tuple(table.array(slot).tolist()) for slot in (1, 2))
    return Operator(kind, inputs, outputs, MappingProxyType(values))


def _tensor(path: Path, table: _Table, buffers: list[_Table]) -> Tensor:
    name, shape = table.text(3), tuple(table.array(0).tolist())
    kind = table.number(1, "Int8")
    if kind not in _DTYPES:
        raise InputError(f"{path}: tensor {name}: type {kind} of TFLite's schema is not supported")
    values = buffers[table.number(2, "Uint32")].array(0, np.uint8).tobytes()
    if not values:
        return Tensor(name, shape)
    flat = np.frombuffer(values, _DTYPES[kind])
    sparsity = table.table(6)
    dense = flat.reshape(shape) if sparsity is None else _dense_array(flat, shape, sparsity)
    return Tensor(name, shape, dense)


def _dense_array(flat: NDArray[Any], shape: tuple[int, ...], sparsity: _Table) -> NDArray[Any]:
    """Return the full array of a sparse constant.

    The levels of the tree are the tensor's axes in `traversal_order`, then those of blocks: level
    `rank + j` counts within the blocks of the axis `block_map[j]`.
    """
    order, blocks = sparsity.array(0).tolist(), sparsity.array(1).tolist()
    places = np.zeros((1, 0), np.int64)  # (nodes of the level, levels so far)
    for level in sparsity.tables(2):
        parents, columns = _child_positions(level, len(places))
        places = np.column_stack([places[parents], columns])
    rank = len(shape)
    at = np.zeros((len(places), rank), np.int64)
    inner = np.zeros((len(places), rank), np.int64)
    size = np.ones(rank, np.int64)
    levels = sparsity.tables(2)
    for k, axis in enumerate(order):
        if axis < rank:
            at[:, axis] = places[:, k]
        else:
            inner[:, blocks[axis - rank]] = places[:, k]
            size[blocks[axis - rank]] = levels[k].number(1)
    dense = np.zeros(shape, flat.dtype)
    dense[tuple((at * size + inner).T)] = flat
    return dense


def _child_positions(level: _Table, parents: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the parent of each node of a level, and its index below that parent."""
    if level.number(0, "Int8") == 0:  # dense
        size = level.number(1)
        return np.repeat(np.arange(parents), size), np.tile(np.arange(size), parents)
    dtypes = {1: np.int32, 2: np.uint16, 3: np.uint8}
    segments, indices = (
        _values(level.union(slot), dtypes[level.number(slot - 1, "Uint8")]) for slot in (3, 5)
    )
    return np.repeat(np.arange(parents), np.diff(segments)), indices


def _values(vector: _Table | None, dtype: Any) -> NDArray[np.int64]:
    assert vector is not None, "a sparse level has segments and indices"
    return vector.array(0, dtype).astype(np.int64)
