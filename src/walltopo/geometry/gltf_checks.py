"""Checks of a glTF file before trimesh reads it: its size, its scene graph, its extensions.

trimesh walks from the root to each node again, and makes arrays of each primitive of each node. A
file of megabytes could therefore cost minutes, or any memory.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Annotated, Final

import msgspec

from walltopo.core import InputError
from walltopo.core.text_files import read_utf8

# trimesh takes seconds for a file at these limits. Scanners and editors write tens of each.
MAX_NODES: Final = 20_000
MAX_PRIMITIVES: Final = 20_000  # of the file, and drawn by its nodes
MAX_DEPTH: Final = 100  # nodes from a root down
_MAX_NUMBERS_PER_BYTE: Final = 64  # more than any compression of glTF achieves

Index = Annotated[int, msgspec.Meta(ge=0, le=2**40)]


class _Accessor(msgspec.Struct, frozen=True):
    count: Index = 0


class _Primitive(msgspec.Struct, frozen=True):
    attributes: dict[str, Index] = {}
    indices: Index | None = None


class _Mesh(msgspec.Struct, frozen=True):
    primitives: tuple[_Primitive, ...] = ()


class _Node(msgspec.Struct, frozen=True):
    children: tuple[Index, ...] = ()
    mesh: Index | None = None


class _Gltf(msgspec.Struct, frozen=True):
    """The part of glTF's JSON that determines how arrays are read, their size and their number."""

    accessors: tuple[_Accessor, ...] = ()
    meshes: tuple[_Mesh, ...] = ()
    nodes: tuple[_Node, ...] = ()
    required: tuple[str, ...] = msgspec.field(default=(), name="extensionsRequired")


def check_gltf(path: Path) -> None:
    """Check that trimesh reads a glTF file right, in time and memory that its size justifies.

    Raises
    ------
    InputError : it requires an unknown extension, declares or draws more numbers than its files can
        hold, or has too many nodes, levels or primitives.
    """
    data = read_utf8(path)
    size = len(data) + sum(item.stat().st_size for item in path.parent.glob("*.bin"))
    if data.startswith(b"glTF"):
        data = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    try:
        table = msgspec.json.decode(data, type=_Gltf)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: damaged: not the JSON of glTF ({error})") from error
    _check_extensions(path, table.required)
    # Without this check, zeros would fill the missing data, at any size.
    if sum(accessor.count for accessor in table.accessors) > _MAX_NUMBERS_PER_BYTE * size:
        raise InputError(f"{path}: damaged: it declares more numbers than {size} bytes can hold")
    _check_number(path, "nodes", len(table.nodes), MAX_NODES)
    _check_number(path, "primitives", sum(len(m.primitives) for m in table.meshes), MAX_PRIMITIVES)
    _check_levels(path, table.nodes)
    _check_drawn(path, table, size)


# Extensions that do not change how vertices and triangles are read.
_LOOKS = re.compile(
    r"(KHR_materials_|KHR_texture_|EXT_texture_|KHR_lights_|EXT_mesh_features|EXT_structural_)"
)


def _check_extensions(path: Path, required: tuple[str, ...]) -> None:
    """Raise InputError if glTF requires an extension without which its geometry is misread."""
    unknown = [name for name in required if not _LOOKS.match(name)]
    if unknown:
        raise InputError(
            f"{path}: it requires the extension {', '.join(unknown)}, which is not read here",
            "Export it without compression, or decompress it: npx @gltf-transform/cli copy, then "
            "dequantize.",
        )


def _check_number(path: Path, what: str, number: int, most: int) -> None:
    if number > most:
        raise InputError(
            f"{path}: has {number} {what}, more than {most}",
            "Join its parts into one mesh: npx @gltf-transform/cli flatten, then join.",
        )


def _check_levels(path: Path, nodes: tuple[_Node, ...]) -> None:
    """Raise InputError if nodes are not trees of at most `MAX_DEPTH` levels."""
    parents = Counter(child for node in nodes for child in node.children)
    missing = next((child for child in parents if child >= len(nodes)), None)
    if missing is not None:
        raise InputError(f"{path}: damaged: it has no node {missing}")
    shared = next((child for child, number in parents.items() if number > 1), None)
    if shared is not None:
        raise InputError(f"{path}: damaged: node {shared} is a child of two nodes")
    level = [number for number in range(len(nodes)) if number not in parents]
    depth = seen = 0
    while level:
        depth, seen = depth + 1, seen + len(level)
        level = [child for number in level for child in nodes[number].children]
    _check_number(path, "levels of nodes", depth, MAX_DEPTH)
    if seen < len(nodes):
        raise InputError(f"{path}: damaged: a node is inside itself")


def _check_drawn(path: Path, table: _Gltf, size: int) -> None:
    """Raise InputError if the nodes draw the meshes too often: each time makes new arrays."""

    def numbers(primitive: _Primitive) -> int:
        of = {*primitive.attributes.values(), primitive.indices}
        return sum(
            table.accessors[one].count
            for one in of
            if one is not None and one < len(table.accessors)
        )

    costs = [sum(numbers(one) for one in mesh.primitives) for mesh in table.meshes]
    times = Counter(node.mesh for node in table.nodes if node.mesh is not None)
    drawn = {mesh: number for mesh, number in times.items() if mesh < len(table.meshes)}
    primitives = sum(len(table.meshes[mesh].primitives) * n for mesh, n in drawn.items())
    _check_number(path, "drawn primitives", primitives, MAX_PRIMITIVES)
    # A mesh that no node draws is read, too.
    total = sum(cost * max(1, drawn.get(mesh, 0)) for mesh, cost in enumerate(costs))
    if total > _MAX_NUMBERS_PER_BYTE * size:
        raise InputError(
            f"{path}: draws its meshes so often that {size} bytes become {total} numbers"
        )
