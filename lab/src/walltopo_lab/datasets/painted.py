"""Painted meshes with one colour per object, painted in Blender or exported from a scan."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.errors import prefix_errors
from walltopo.core.files import atomic_path
from walltopo.geometry.mesh_files import int32_faces, load_with_trimesh
from walltopo_lab.datasets.legend import Legend, Rgb, object_colours


@dataclass(frozen=True, eq=False)
class Painted:
    """Instances derived from the colours of a mesh.

    Parameters
    ----------
    mesh : the painted mesh.
    face_instance : (F,) int32, 0 = wall.
    labels : class id of each instance (index in `Legend.classes` plus 1).
    colours : colour of each instance.
    """

    mesh: Mesh
    face_instance: NDArray[np.int32]
    labels: dict[int, int]
    colours: dict[int, Rgb]


def _load_colours(path: Path) -> tuple[Mesh, NDArray[np.uint8], list[str] | None]:
    """Return the mesh, (F, 3) face colours, and material names per face if there are several."""
    import trimesh

    loaded = load_with_trimesh(path)
    try:
        parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    except Exception as error:  # trimesh raises many exception types for broken files
        raise InputError(f"{path}: cannot be read as a mesh ({error})") from error
    vertices: list[NDArray[np.float64]] = []
    faces: list[NDArray[np.int64]] = []
    colours: list[NDArray[np.uint8]] = []
    materials: list[str] = []
    offset = 0
    for part in parts:
        if not isinstance(part, trimesh.Trimesh):
            continue
        with prefix_errors(path):
            whole = Mesh(np.asarray(part.vertices), int32_faces(part.faces))
        vertices.append(whole.vertices)
        faces.append(whole.faces.astype(np.int64) + offset)
        offset += len(part.vertices)
        found, material = _part_colours(part, path)
        colours.append(found)
        materials += [material] * len(part.faces)
    if not faces or not sum(len(f) for f in faces):
        raise InputError(f"{path}: holds no triangles")
    mesh = Mesh(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))
    named = materials if any(materials) else None
    return mesh, np.concatenate(colours), named


def _part_colours(part: object, path: Path) -> tuple[NDArray[np.uint8], str]:
    visual = part.visual  # type: ignore[attr-defined]
    faces = np.asarray(part.faces)  # type: ignore[attr-defined]
    if visual.kind == "vertex":
        corners = np.asarray(visual.vertex_colors)[:, :3][faces]
        # Use the colour that two corners share; if all three differ, use that of the first corner.
        second = (corners[:, 1] == corners[:, 2]).all(axis=1)
        return np.where(second[:, None], corners[:, 1], corners[:, 0]).astype(np.uint8), ""
    if visual.kind == "face":
        return np.asarray(visual.face_colors)[:, :3].astype(np.uint8), ""
    if visual.kind == "texture" and visual.material is not None:
        material = visual.material
        colour = np.asarray(material.main_color)[:3].astype(np.uint8)
        return np.tile(colour, (len(faces), 1)), str(getattr(material, "name", "") or "")
    raise InputError(
        f"{path}: has no colours",
        "Paint its vertices or faces, or give it materials; in Blender export with vertex colours.",
    )


def read_painted(path: Path, legend: Legend | None = None, split: bool = False) -> Painted:
    """Read a painted mesh (PLY, OBJ, GLB).

    A material whose name begins with a class of the legend has that class, and each connected
    part of it is an object; `wall...` is the wall. Otherwise each colour is an object.

    Parameters
    ----------
    legend : meaning of the colours; by default grey and white are wall, all others holds.
    split : make each connected part of one colour an object of its own.

    Raises
    ------
    InputError : the file is missing, is no mesh, or has no colours.
    """
    rules = legend or Legend()
    mesh, face_colours, materials = _load_colours(Path(path))
    if materials is not None:
        return _from_materials(mesh, face_colours, materials, rules)
    packed = face_colours.astype(np.int64) @ np.array([65536, 256, 1])
    values, first, index = np.unique(packed, return_index=True, return_inverse=True)
    table = face_colours[first].astype(np.int64)
    known = list(rules.wall) + list(rules.objects)
    gap = np.abs(table[:, None] - np.array(known)[None]).max(axis=2)
    nearest, near = gap.argmin(axis=1), gap.min(axis=1) <= rules.tolerance
    # Colours that match the same listed colour are one object; others are grouped by exact value.
    meaning = np.where(near, nearest, len(known) + np.arange(len(values)))
    is_wall = near & (nearest < len(rules.wall))
    _, group_of = np.unique(meaning, return_inverse=True)
    group = np.where(is_wall, 0, group_of + 1)[index]
    if split:
        group = _connected_parts(mesh, group)
    kept, numbers = np.unique(group, return_inverse=True)
    face_instance = (numbers + (0 if len(kept) and kept[0] == 0 else 1)).astype(np.int32)
    labels: dict[int, int] = {}
    colours: dict[int, Rgb] = {}
    ids, where = np.unique(face_instance, return_index=True)
    for number, face in zip(ids.tolist(), where.tolist(), strict=True):
        if number == 0:
            continue
        value = int(index[face])
        colour: Rgb = known[nearest[value]] if near[value] else _as_rgb(table[value])
        labels[number] = 1 + rules.classes.index(rules.objects.get(colour, rules.default))
        colours[number] = colour
    return Painted(mesh, face_instance, labels, colours)


def _as_rgb(colour: NDArray[np.int64]) -> Rgb:
    return int(colour[0]), int(colour[1]), int(colour[2])


def _from_materials(
    mesh: Mesh, face_colours: NDArray[np.uint8], materials: list[str], rules: Legend
) -> Painted:
    def class_of(name: str) -> int:
        lower = name.lower()
        if lower.startswith("wall"):
            return 0
        match = (k for k, c in enumerate(rules.classes, 1) if lower.startswith(c.lower()))
        return next(match, 1 + rules.classes.index(rules.default))

    names = sorted(set(materials))
    of_name = {name: class_of(name) for name in names}
    kind = np.array([names.index(name) + 1 if of_name[name] else 0 for name in materials])
    face_instance = _connected_parts(mesh, kind).astype(np.int32)
    ids, where = np.unique(face_instance, return_index=True)
    labels = {int(i): of_name[materials[f]] for i, f in zip(ids, where, strict=True) if i}
    colours = {
        int(i): _as_rgb(face_colours[f].astype(np.int64))
        for i, f in zip(ids, where, strict=True)
        if i
    }
    return Painted(mesh, face_instance, labels, colours)


def _connected_parts(mesh: Mesh, group: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number the connected parts of equal non-zero groups from 1, in the order of their faces.

    Faces are neighbours if they share a position, so that vertices duplicated by an exporter do not
    split objects.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    _, place = np.unique(mesh.vertices.round(6), axis=0, return_inverse=True)
    faces = np.flatnonzero(group)
    # One node per (position, group): touching faces of different groups stay separate.
    nodes = place.reshape(-1)[mesh.faces[faces]] * (int(group.max()) + 1) + group[faces, None]
    kept, node = np.unique(nodes, return_inverse=True)
    node = node.reshape(-1, 3)
    links = np.concatenate([node[:, [0, 1]], node[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(links)), links.T), shape=(len(kept), len(kept)))
    _, part = connected_components(graph, directed=False)
    _, numbers = np.unique(part[node[:, 0]], return_inverse=True)
    result = np.zeros(len(group), dtype=np.int64)
    result[faces] = numbers + 1
    return result


def paint_instances(
    face_instance: NDArray[np.int32], labels: dict[int, int], classes: tuple[str, ...]
) -> tuple[NDArray[np.uint8], Legend]:
    """Return (F, 3) face colours of a scan's instances, and the legend that decodes them."""
    ids = sorted(labels)
    table = object_colours(max(len(ids), 1))
    wall = Legend().wall[0]
    colours = np.tile(np.array(wall, dtype=np.uint8), (len(face_instance), 1))
    lookup = np.tile(np.array(wall, dtype=np.uint8), (max([0, *ids]) + 1, 1))
    for k, number in enumerate(ids):
        lookup[number] = table[k]
    colours = lookup[face_instance]
    objects = {
        _as_rgb(table[k].astype(np.int64)): classes[labels[i] - 1] for k, i in enumerate(ids)
    }
    return colours, Legend(objects=objects, classes=classes)


def write_painted(path: Path, mesh: Mesh, face_colours: NDArray[np.uint8]) -> None:
    """Write a PLY with vertex colours (editable in Blender) and face colours; atomic.

    Vertices are duplicated at colour borders, so that each triangle has one colour at all corners.
    """
    packed = face_colours.astype(np.int64) @ np.array([65536, 256, 1])
    corner = mesh.faces.astype(np.int64) * (1 << 24) + packed[:, None]
    pairs, index = np.unique(corner, return_inverse=True)
    value = pairs % (1 << 24)
    colours = np.stack([value >> 16, (value >> 8) & 255, value & 255], axis=1).astype(np.uint8)
    from walltopo.geometry.mesh_files import write_ply

    with atomic_path(path) as temporary:
        split = Mesh(mesh.vertices[pairs >> 24], index.reshape(-1, 3).astype(np.int32), colours)
        write_ply(temporary, split)
