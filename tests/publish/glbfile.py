"""Reading a GLB in tests, independently of the writer."""

from __future__ import annotations

import itertools
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

KINDS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Glb:
    """JSON and binary of a GLB; `accessor(k)` and `column(...)` give arrays."""

    def __init__(self, data: bytes) -> None:
        magic, version, total = struct.unpack_from("<4sII", data)
        assert (magic, version, total) == (b"glTF", 2, len(data))
        length, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        self.json: dict[str, Any] = json.loads(data[20 : 20 + length])
        size, kind = struct.unpack_from("<I4s", data, 20 + length)
        assert kind == b"BIN\0"
        self.binary = data[28 + length : 28 + length + size]

    @classmethod
    def read(cls, path: Path) -> Glb:
        return cls(path.read_bytes())

    def view(self, index: int) -> bytes:
        entry = self.json["bufferViews"][index]
        packed = entry.get("extensions", {}).get("EXT_meshopt_compression")
        if packed is None:
            start = entry["byteOffset"]
            return self.binary[start : start + entry["byteLength"]]
        from meshoptimizer import decoder

        data = self.binary[packed["byteOffset"] : packed["byteOffset"] + packed["byteLength"]]
        count, stride = packed["count"], packed["byteStride"]
        if packed["mode"] == "TRIANGLES":
            return bytes(decoder.decode_index_buffer(count, stride, data).tobytes())
        return bytes(decoder.decode_vertex_buffer(count, stride, data).tobytes())

    def accessor(self, index: int) -> Any:
        entry = self.json["accessors"][index]
        view = self.json["bufferViews"][entry["bufferView"]]
        dtype, width = np.dtype(KINDS[entry["componentType"]]), WIDTHS[entry["type"]]
        data = self.view(entry["bufferView"])
        stride = view.get("byteStride", dtype.itemsize * width)
        rows = np.frombuffer(data, np.uint8)[: entry["count"] * stride].reshape(-1, stride)
        flat = np.ascontiguousarray(rows[:, : dtype.itemsize * width]).view(dtype)
        return flat[:, 0] if width == 1 else flat

    @property
    def primitive(self) -> dict[str, Any]:
        entry: dict[str, Any] = self.json["meshes"][0]["primitives"][0]
        return entry

    def attribute(self, name: str) -> Any:
        return self.accessor(self.primitive["attributes"][name])

    def triangles(self) -> Any:
        return self.accessor(self.primitive["indices"]).reshape(-1, 3).astype(int)

    def column(self, table: int, name: str) -> Any:
        """Values of a column of a property table, by row."""
        metadata = self.json["extensions"]["EXT_structural_metadata"]
        entry = metadata["propertyTables"][table]
        schema = metadata["schema"]["classes"][entry["class"]]["properties"][name]
        stored = entry["properties"][name]
        data = self.view(stored["values"])
        if schema["type"] == "STRING":
            ends = np.frombuffer(self.view(stored["stringOffsets"]), "<u4")
            return [data[a:b].decode() for a, b in itertools.pairwise(ends)]
        kind = {"FLOAT32": "<f4", "INT32": "<i4", "UINT32": "<u4"}[schema["componentType"]]
        values = np.frombuffer(data, kind)
        if schema.get("array"):
            ends = np.frombuffer(self.view(stored["arrayOffsets"]), "<u4")
            return [values[a:b].tolist() for a, b in itertools.pairwise(ends)]
        width = {"SCALAR": 1, "VEC3": 3}[schema["type"]]
        return values.reshape(entry["count"], width).squeeze()
