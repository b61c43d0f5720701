"""Read and write mesh files: PLY, OBJ, GLB, STL, OFF."""

from __future__ import annotations

import io
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.errors import prefix_errors
from walltopo.core.files import atomic_path, join_inside
from walltopo.core.text_files import as_utf8, read_utf8
from walltopo.geometry.gltf_checks import check_gltf
from walltopo.geometry.polygon_files import GUESSED, read_obj, read_ply

_FLOAT32_STEP = 1e-5  # of a mesh's extent: a tenth of a millimetre on a wall of ten metres


def fits_float32(vertices: NDArray[np.float64]) -> bool:
    """Return whether float32 keeps the shape of a mesh, which it does not far from the origin."""
    if not len(vertices):
        return True
    extent = float(np.ptp(vertices, axis=0).max())
    return bool(np.spacing(np.float32(np.abs(vertices).max())) <= _FLOAT32_STEP * extent)


def write_ply(path: Path, mesh: Mesh, instance: NDArray[np.int32] | None = None) -> None:
    """Write a mesh as binary PLY (float32 vertices, uint8 colours if present), atomically.

    Vertices far from the origin, as in UTM, are float64, because float32 would lose their shape.
    If the mesh has guessed triangles, faces have a property `guessed`, 1 for guessed.

    Parameters
    ----------
    instance : (F,) written as the faces' property `instance`.
    """
    colours = mesh.vertex_colours
    short = fits_float32(mesh.vertices)
    fields: list[tuple[str, str]] = [(axis, "<f4" if short else "<f8") for axis in "xyz"]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.vertices)}"]
    header += [f"property {'float' if short else 'double'} {axis}" for axis in "xyz"]
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
        face_fields.append((GUESSED, "u1"))
        header.append(f"property uchar {GUESSED}")
    faces = np.zeros(len(mesh.faces), dtype=face_fields)
    faces["n"], faces["v"] = 3, mesh.faces
    if instance is not None:
        faces["instance"] = instance
    if mesh.guessed is not None:
        faces[GUESSED] = mesh.guessed
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        stream.write(("\n".join([*header, "end_header"]) + "\n").encode("ascii"))
        stream.write(vertices.tobytes())
        stream.write(faces.tobytes())


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A mesh as its file has it.

    Parameters
    ----------
    mesh : the triangles, in the order of the file's faces.
    file_face : (F,) int, face of the file that each triangle is a part of; None if the file has
        triangles only.
    """

    mesh: Mesh
    file_face: NDArray[np.int64] | None = None


def read_mesh(path: Path) -> Mesh:
    """Read a triangle mesh (PLY, OBJ, glTF, STL, OFF) without changing its vertices.

    Triangles have the order of the file's faces; polygons of PLY and OBJ are split in place.

    Raises
    ------
    InputError : the file is missing, unreadable or holds no triangles.
    """
    return read_mesh_file(path).mesh


def read_mesh_file(path: Path) -> MeshFile:
    """Read a mesh as `read_mesh`, with the face of the file for each triangle."""
    path = Path(path)
    reader = {".obj": read_obj, ".ply": read_ply}.get(path.suffix.lower())
    if reader is None or not path.is_file():
        return MeshFile(_read_by_trimesh(path))
    content = _file_content(path)
    if path.suffix.lower() == ".ply":
        _check_counts(path, content)
    with prefix_errors(path):
        found = reader(content)
        triangles, polygon = found.triangles()
        if len(triangles) == 0:
            raise InputError("holds no triangles", "A point cloud must be meshed first.")
        guessed = found.guessed
        if guessed is not None and polygon is not None:
            guessed = guessed[polygon]
        return MeshFile(
            Mesh(found.vertices, int32_faces(triangles), found.colours, guessed), polygon
        )


def _read_by_trimesh(path: Path) -> Mesh:
    import trimesh

    loaded = load_with_trimesh(path)
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
    with prefix_errors(path):
        return Mesh(np.asarray(loaded.vertices), int32_faces(loaded.faces), colours)


# trimesh reads more formats, including archives, which are not accepted.
SUFFIXES = (".ply", ".obj", ".glb", ".gltf", ".stl", ".off")
_HEADER = 64_000
MAX_MATERIALS = 2_000  # of an OBJ; trimesh takes seconds for so many


PICTURES = (".png", ".jpg", ".jpeg", ".webp")


def load_with_trimesh(path: Path, *, pictures: bool = False) -> Any:
    """Load a mesh file with trimesh, as a `Trimesh`, `Scene` or `PointCloud`.

    Referenced files are read from the mesh's own folder only.

    Parameters
    ----------
    pictures : whether pictures beside the mesh are opened too, as textures; the order of vertices
        and faces is then arbitrary.

    Raises
    ------
    InputError : the file is missing, of an unknown type, damaged, or declares too much data.
    """
    import trimesh

    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: not a mesh file; expected one of {', '.join(SUFFIXES)}")
    content = _file_content(path)
    if path.suffix.lower() == ".ply":
        _check_counts(path, content)
    if path.suffix.lower() in (".glb", ".gltf"):
        check_gltf(path)
    if path.suffix.lower() == ".obj":
        _check_materials(path, content)

    try:
        return trimesh.load(
            # From memory: a streamed file could declare any length and so allocate any memory.
            io.BytesIO(content),
            file_type=path.suffix[1:].lower(),
            resolver=_local_resolver(path.parent, pictures),
            process=False,
            # trimesh loses texture coordinates if it has to keep the vertices of an OBJ.
            maintain_order=not pictures,
        )
    except Exception as error:  # trimesh raises many kinds for broken files
        raise InputError(f"{path}: cannot be read as a mesh ({error})") from error


def _local_resolver(folder: Path, pictures: bool) -> Any:
    """Return a trimesh resolver for materials and buffers beside a mesh."""
    from trimesh.resolvers import Resolver

    accepted = (".mtl", ".bin", *(PICTURES if pictures else ()))

    class LocalResolver(Resolver):
        def __init__(self) -> None:
            pass

        def get(self, name: str) -> bytes:
            found = join_inside(folder, name)
            if found.suffix.lower() not in accepted:
                raise FileNotFoundError(name)
            return read_utf8(found) if found.suffix.lower() == ".mtl" else found.read_bytes()

        def write(self, name: str, data: bytes) -> None:
            raise PermissionError(name)

        def keys(self) -> list[str]:
            return []

        def namespaced(self, namespace: str) -> LocalResolver:
            return self

    return LocalResolver()


def _file_content(path: Path) -> bytes:
    """Return the bytes of a mesh file, text as UTF-8 without a byte-order mark."""
    if path.suffix.lower() != ".stl":
        return read_utf8(path)
    content = path.read_bytes()  # the first 80 bytes of a binary STL are arbitrary
    with suppress(InputError):
        if as_utf8(content[:16]).startswith(b"solid"):
            return read_utf8(path)
    return content


def _check_counts(path: Path, content: bytes) -> None:
    """Raise InputError if a PLY declares more entries than it has bytes: counts size the arrays."""
    size = len(content)
    head = content[:_HEADER].partition(b"end_header")[0]
    for count in re.findall(rb"^\s*element\s+\S+\s+(\S+)", head, flags=re.MULTILINE):
        if not count.isdigit() or len(count) > 18 or int(count) > size:
            claimed = count[:20].decode("ascii", "replace")
            raise InputError(f"{path}: damaged: it declares {claimed} entries in {size} bytes")


_REFERENCES = {
    ".obj": re.compile(rb"^\s*mtllib\s+(.+?)\s*$", re.MULTILINE),
    ".mtl": re.compile(rb"^\s*map_Kd\s+(?:-\S+ \S+ )*(.+?)\s*$", re.MULTILINE | re.IGNORECASE),
    ".gltf": re.compile(rb'"uri"\s*:\s*"([^":]+)"'),
}


def files_of_mesh(path: Path) -> list[Path]:
    """Return the existing files in a mesh's folder that the mesh refers to: materials, textures."""
    pattern = _REFERENCES.get(path.suffix.lower())
    if pattern is None or not path.is_file():
        return []
    found: list[Path] = []
    for name in dict.fromkeys(pattern.findall(read_utf8(path))):
        with suppress(InputError):  # a name that leads out of the folder is not read either
            file = join_inside(path.parent, name.decode("utf-8", "replace"))
            if file.is_file():
                found += [file, *files_of_mesh(file)]
    return found


def _check_materials(path: Path, content: bytes) -> None:
    """Raise InputError if an OBJ has more materials than trimesh reads in reasonable time, which
    grows with their square."""
    number = len(set(re.findall(rb"^[ \t]*usemtl[ \t]+(.*)$", content, re.MULTILINE)))
    if number > MAX_MATERIALS:
        raise InputError(
            f"{path}: has {number} materials, more than {MAX_MATERIALS}",
            "Export the mesh with one texture, or without any.",
        )


def int32_faces(faces: object) -> NDArray[np.int32]:
    """Return (F, 3) int32 faces; indices beyond int32 are clipped instead of wrapped."""
    given = np.asarray(faces)
    if given.dtype == np.int32:
        return given
    wide = given.astype(np.int64)
    return np.clip(wide, -1, 2**31 - 1).astype(np.int32)
