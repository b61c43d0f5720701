"""A minimal writer of binary glTF 2.0: buffer views, accessors, property tables, one file.

Source: Khronos, "glTF 2.0 Specification", sections 3.6 (binary data) and 4.4 (GLB).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.publish.tables import Column

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
_COMPONENT = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_KIND = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_NUMPY = {"FLOAT32": "<f4", "INT32": "<i4", "UINT32": "<u4"}


class GlbWriter:
    """Collects binary parts and the JSON that refers to them.

    Parameters
    ----------
    compress : store geometry by `EXT_meshopt_compression` (smaller; readers need the decoder).
    """

    def __init__(self, compress: bool = False) -> None:
        self.compress = compress
        self.parts: list[bytes | memoryview] = []
        self.length = 0  # bytes of `parts`
        self.fallback_length = 0
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.extensions: set[str] = set()
        self.required: set[str] = set()

    def use(self, name: str, required: bool = False) -> None:
        """Declare an extension."""
        self.extensions.add(name)
        if required:
            self.required.add(name)

    def _append(self, data: bytes | memoryview) -> int:
        # Property tables need 8-byte alignment; accessors accept it.
        padding = b"\0" * (-self.length % 8)
        offset = self.length + len(padding)
        self.parts += [padding, data]
        self.length = offset + len(data)
        return offset

    def view(self, data: bytes | memoryview, **fields: Any) -> int:
        """Add a plain buffer view of bytes, which are not copied; return its index."""
        offset = self._append(data)
        entry = {"buffer": 0, "byteOffset": offset, "byteLength": len(data), **fields}
        self.views.append(entry)
        return len(self.views) - 1

    def _packed_view(self, packed: bytes, raw: int, count: int, stride: int, **fields: Any) -> int:
        """Add a meshopt view: `packed` data, and `raw` bytes of the fallback; return its index."""
        mode = "TRIANGLES" if fields.get("target") == ELEMENT_ARRAY_BUFFER else "ATTRIBUTES"
        offset = self._append(packed)
        start = self.fallback_length
        self.fallback_length += raw + (-raw % 8)
        extension = {
            "buffer": 0,
            "byteOffset": offset,
            "byteLength": len(packed),
            "byteStride": stride,
            "count": count,
            "mode": mode,
        }
        entry = {"buffer": 1, "byteOffset": start, "byteLength": raw, **fields}
        entry["extensions"] = {"EXT_meshopt_compression": extension}
        self.views.append(entry)
        self.use("EXT_meshopt_compression", required=True)
        return len(self.views) - 1

    def _accessor(self, view: int, values: NDArray[Any], count: int, kind: str, **more: Any) -> int:
        component = _COMPONENT[values.dtype.str[1:]]
        entry = {"bufferView": view, "componentType": component, "count": count, "type": kind}
        self.accessors.append({**entry, **more})
        return len(self.accessors) - 1

    def attribute(
        self, values: NDArray[Any], *, normalized: bool = False, bounds: bool = False
    ) -> int:
        """Add a vertex attribute of (V,) or (V, n) values; return its accessor's index.

        Elements are padded to multiples of four bytes, as glTF requires.
        """
        table = values.reshape(len(values), -1)
        width = table.shape[1] * table.itemsize
        stride = width + (-width % 4)
        padded = np.ascontiguousarray(table)
        if stride > width:
            padded = np.zeros((len(table), stride // table.itemsize), dtype=table.dtype)
            padded[:, : table.shape[1]] = table
        fields: dict[str, Any] = {"target": ARRAY_BUFFER, "byteStride": stride}
        if self.compress:
            from meshoptimizer import encoder

            encoder.encode_vertex_version(0)
            packed = encoder.encode_vertex_buffer(padded, len(padded), stride)
            view = self._packed_view(packed, padded.nbytes, len(padded), stride, **fields)
        else:
            view = self.view(_bytes_of(padded), **fields)
        more: dict[str, Any] = {"normalized": True} if normalized else {}
        if bounds:
            more |= {"min": table.min(axis=0).tolist(), "max": table.max(axis=0).tolist()}
        return self._accessor(view, table, len(table), _KIND[table.shape[1]], **more)

    def indices(self, triangles: NDArray[np.uint32], vertices: int) -> int:
        """Add the triangle indices; return their accessor's index."""
        flat = np.ascontiguousarray(triangles.ravel(), dtype=np.uint32)
        narrow = flat.astype(np.uint16) if vertices <= 65535 else flat
        fields: dict[str, Any] = {"target": ELEMENT_ARRAY_BUFFER}
        if self.compress:
            from meshoptimizer import encoder

            encoder.encode_index_version(1)
            packed = encoder.encode_index_buffer(flat, len(flat), vertices)
            stride = narrow.itemsize
            view = self._packed_view(packed, narrow.nbytes, len(flat), stride, **fields)
        else:
            view = self.view(_bytes_of(narrow), **fields)
        return self._accessor(view, narrow, len(flat), "SCALAR")

    def _strings(self, texts: Sequence[str]) -> dict[str, Any]:
        encoded = [text.encode("utf-8") for text in texts]
        offsets = np.cumsum([0, *(len(item) for item in encoded)]).astype("<u4")
        # A buffer view must not be empty; the offsets show that its byte is unused.
        return {
            "values": self.view(b"".join(encoded) or b"\0"),
            "stringOffsets": self.view(offsets.tobytes()),
            "stringOffsetType": "UINT32",
        }

    def _lists(self, rows: Sequence[Sequence[int]], component: str) -> dict[str, Any]:
        flat = np.array([item for row in rows for item in row], dtype=_NUMPY[component])
        offsets = np.cumsum([0, *(len(row) for row in rows)]).astype("<u4")
        return {
            "values": self.view(flat.tobytes() or b"\0" * 4),
            "arrayOffsets": self.view(offsets.tobytes()),
            "arrayOffsetType": "UINT32",
        }

    def property_table(self, name: str, kind: str, columns: Sequence[Column]) -> dict[str, Any]:
        """Store columns; return the `propertyTables` entry of `EXT_structural_metadata`."""
        properties: dict[str, Any] = {}
        for column in columns:
            if column.schema["type"] == "STRING":
                properties[column.name] = self._strings(column.values)
            elif column.schema.get("array"):
                properties[column.name] = self._lists(column.values, column.schema["componentType"])
            else:
                values = np.asarray(column.values, _NUMPY[column.schema["componentType"]])
                properties[column.name] = {"values": self.view(values.tobytes())}
        count = len(columns[0].values)
        return {"name": name, "class": kind, "count": count, "properties": properties}

    def finish(self, document: dict[str, Any]) -> bytes:
        """Return the GLB of `document` (all but buffers, views, accessors, extensions)."""
        buffers: list[dict[str, Any]] = [{"byteLength": self.length}]
        if self.fallback_length:
            fallback = {"EXT_meshopt_compression": {"fallback": True}}
            buffers.append({"byteLength": self.fallback_length, "extensions": fallback})
        complete = {
            **document,
            "buffers": buffers,
            "bufferViews": self.views,
            "accessors": self.accessors,
        }
        if self.extensions:
            complete["extensionsUsed"] = sorted(self.extensions)
        if self.required:
            complete["extensionsRequired"] = sorted(self.required)
        text = json.dumps(complete, separators=(",", ":"), allow_nan=False).encode("utf-8")
        text += b" " * (-len(text) % 4)
        padding = b"\0" * (-self.length % 4)
        binary = self.length + len(padding)
        head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + binary)
        chunk_json = struct.pack("<I4s", len(text), b"JSON")
        chunk_bin = struct.pack("<I4s", binary, b"BIN\0")
        return b"".join([head, chunk_json, text, chunk_bin, *self.parts, padding])


def _bytes_of(values: NDArray[Any]) -> memoryview:
    """Return the bytes of an array in memory, without a copy if it is contiguous."""
    return np.ascontiguousarray(values).reshape(-1).view(np.uint8).data
