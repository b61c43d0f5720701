"""PLY triangle meshes, binary and ASCII in, binary little-endian out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.errors import naming
from walltopo.core.files import atomic_path
from walltopo.geometry.foreign import int32_faces, load_foreign

_GUESSED = "guessed"


def write_ply(path: Path, mesh: Mesh, instance: NDArray[np.int32] | None = None) -> None:
    """Write a mesh as binary PLY (float32 vertices, uint8 colours if it has them); atomic.

    Where triangles are guessed, faces have a property `guessed`, 1 for those.

    Parameters
    ----------
    instance : (F,) written as the faces' property `instance`.
    """
    colours = mesh.vertex_colours
    fields: list[tuple[str, str]] = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.vertices)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    if colours is not None:
        fields += [("red", "u1"), ("green", "u1"), ("blue", "u1")]
        header += [f"property uchar {name}" for name in ("red", "green", "blue")]
    header += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices"]
    vertices = np.zeros(len(mesh.vertices), dtype=fields)
    for k, axis in enumerate("xyz"):
        vertices[axis] = mesh.vertices[:, k]
    if colours is not None:
        for k, name in enumerate(("red", "green", "blue")):
            vertices[name] = colours[:, k]
    face_fields: list[tuple[Any, ...]] = [("n", "u1"), ("v", "<i4", (3,))]
    if instance is not None:
        face_fields.append(("instance", "<i4"))
        header.append("property int instance")
    if mesh.guessed is not None:
        face_fields.append((_GUESSED, "u1"))
        header.append(f"property uchar {_GUESSED}")
    faces = np.zeros(len(mesh.faces), dtype=face_fields)
    faces["n"], faces["v"] = 3, mesh.faces
    if instance is not None:
        faces["instance"] = instance
    if mesh.guessed is not None:
        faces[_GUESSED] = mesh.guessed
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        stream.write(("\n".join([*header, "end_header"]) + "\n").encode("ascii"))
        stream.write(vertices.tobytes())
        stream.write(faces.tobytes())


def read_mesh(path: Path) -> Mesh:
    """Read a triangle mesh (PLY, OBJ, glTF, STL, OFF), vertices as they are.

    Raises
    ------
    InputError : the file is missing, unreadable or holds no triangles.
    """
    import trimesh

    path = Path(path)
    loaded = load_foreign(path)
    try:
        if isinstance(loaded, trimesh.Scene):
            loaded = loaded.to_mesh()
    except Exception as error:  # trimesh raises many kinds for broken files
        raise InputError(f"{path}: cannot be read as a mesh ({error})") from error
    if not isinstance(loaded, trimesh.Trimesh) or len(loaded.faces) == 0:
        raise InputError(f"{path}: holds no triangles", "A point cloud must be meshed first.")
    colours = None
    if loaded.visual.kind == "vertex":
        colours = np.ascontiguousarray(np.asarray(loaded.visual.vertex_colors)[:, :3], np.uint8)
    with naming(path):
        faces = int32_faces(loaded.faces)
        return Mesh(np.asarray(loaded.vertices), faces, colours, _guessed(loaded))


def _guessed(loaded: Any) -> NDArray[np.bool_] | None:
    """(F,) of the faces' property `guessed` in a PLY; None where it has none."""
    table = loaded.metadata.get("_ply_raw", {}).get("face", {}).get("data")
    names = table if isinstance(table, dict) else getattr(table, "dtype", np.dtype("f4")).names
    if table is None or _GUESSED not in (names or ()):
        return None
    values = np.asarray(table[_GUESSED])
    if values.dtype.kind not in "iuf":
        raise InputError(f"mesh guesses: expected a number a face, got {values.dtype}")
    return values != 0
