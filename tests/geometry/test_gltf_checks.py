"""Files that would cost trimesh minutes or any memory are refused before it reads them."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.geometry.gltf_checks import MAX_DEPTH, MAX_NODES, MAX_PRIMITIVES
from walltopo.geometry.mesh_files import MAX_MATERIALS, load_with_trimesh, read_mesh

Json = dict[str, Any]
_PRIMITIVE = {"attributes": {"POSITION": 0}, "indices": 1}
_MESH = {"primitives": [_PRIMITIVE]}


def glb(nodes: list[Json], meshes: list[Json], triangles: int = 1) -> bytes:
    """Return a file whose meshes are all of the same triangles; its roots have no parent."""
    corners = np.tile(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4"), (triangles, 1))
    order = np.arange(3 * triangles, dtype="<u4")
    below = {child for node in nodes for child in node.get("children", ())}
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(corners), "type": "VEC3"},
        {"bufferView": 1, "componentType": 5125, "count": len(order), "type": "SCALAR"},
    ]
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": corners.nbytes},
        {"buffer": 0, "byteOffset": corners.nbytes, "byteLength": order.nbytes},
    ]
    table = {
        "asset": {"version": "2.0"},
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": corners.nbytes + order.nbytes}],
        "meshes": meshes,
        "nodes": nodes,
        "scene": 0,
        "scenes": [{"nodes": [n for n in range(len(nodes)) if n not in below]}],
    }
    text = json.dumps(table).encode()
    text += b" " * (-len(text) % 4)
    data = corners.tobytes() + order.tobytes()
    size = 12 + 8 + len(text) + 8 + len(data)
    return (
        struct.pack("<4sII", b"glTF", 2, size)
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(data), b"BIN\0")
        + data
    )


def chain(length: int) -> list[Json]:
    """Return nodes inside each other, each of which draws the mesh."""
    nodes: list[Json] = [{"mesh": 0, "children": [n + 1]} for n in range(length - 1)]
    return [*nodes, {"mesh": 0}]


@contextmanager
def unread(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fail if trimesh reads anything in the block."""
    import trimesh

    def load(*_: object, **__: object) -> object:
        raise AssertionError("trimesh reads it")

    with monkeypatch.context() as patch:
        patch.setattr(trimesh, "load", load)
        yield


def test_nodes_inside_each_other_are_read(tmp_path: Path) -> None:
    path = tmp_path / "m.glb"
    path.write_bytes(glb(chain(MAX_DEPTH), [_MESH]))
    assert len(read_mesh(path).faces) == MAX_DEPTH


@pytest.mark.parametrize(
    ("nodes", "meshes", "word"),
    [
        (chain(MAX_DEPTH + 1), [_MESH], "levels"),
        (chain(200_000), [_MESH], "nodes"),
        ([{"mesh": 0}] * (MAX_NODES + 1), [_MESH], "nodes"),
        ([{"mesh": 0}], [{"primitives": [_PRIMITIVE] * (MAX_PRIMITIVES + 1)}], "primitives"),
        ([{"mesh": 0}], [_MESH] * (MAX_PRIMITIVES + 1), "primitives"),
        ([{"mesh": 0}] * 3, [{"primitives": [_PRIMITIVE] * (MAX_PRIMITIVES // 2)}], "drawn"),
        ([{"children": [1]}, {"children": [0], "mesh": 0}], [_MESH], "inside itself"),
        ([{"children": [0], "mesh": 0}], [_MESH], "inside itself"),
        ([{"children": [2]}, {"children": [2]}, {"mesh": 0}], [_MESH], "two nodes"),
        ([{"children": [1, 1]}, {"mesh": 0}], [_MESH], "two nodes"),
        ([{"children": [7], "mesh": 0}], [_MESH], "no node 7"),
    ],
    ids=[
        "deep",
        "very deep",
        "nodes",
        "primitives",
        "meshes",
        "drawn",
        "circle",
        "itself",
        "two parents",
        "twice",
        "missing",
    ],
)
def test_a_scene_that_costs_too_much_never_reaches_trimesh(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    nodes: list[Json],
    meshes: list[Json],
    word: str,
) -> None:
    path = tmp_path / "m.glb"
    path.write_bytes(glb(nodes, meshes))
    with unread(monkeypatch), pytest.raises(InputError, match=word):
        read_mesh(path)


def test_a_mesh_is_not_drawn_until_the_memory_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "m.glb"
    path.write_bytes(glb([{"mesh": 0}] * 20, [_MESH], triangles=2_000))
    assert len(read_mesh(path).faces) == 40_000
    path.write_bytes(glb([{"mesh": 0}] * 5_000, [_MESH], triangles=2_000))
    with unread(monkeypatch), pytest.raises(InputError, match="so often"):
        read_mesh(path)
    many = [{"primitives": [_PRIMITIVE] * 5_000}]
    path.write_bytes(glb([{"mesh": 0}], many, triangles=20_000))
    with unread(monkeypatch), pytest.raises(InputError, match="so often"):
        read_mesh(path)


def test_an_obj_of_many_materials_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "m.obj"
    path.write_text(obj(lambda n: n % 2))
    assert load_with_trimesh(path, pictures=True) is not None
    path.write_text(obj(lambda n: n))
    with unread(monkeypatch), pytest.raises(InputError, match="materials"):
        load_with_trimesh(path, pictures=True)


def obj(material: Callable[[int], int]) -> str:
    """Return an OBJ whose triangles have materials by their numbers."""
    faces = (f"usemtl m{material(n)}\nf 1 2 3\n" for n in range(MAX_MATERIALS + 1))
    return "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(faces)
