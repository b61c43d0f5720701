"""Read a ready mesh with its texture as one surface and one atlas."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.errors import prefix_errors
from walltopo.core.view import check_picture_size
from walltopo.geometry.mesh_files import int32_faces, load_with_trimesh
from walltopo.geometry.topology import compact_vertices, split_fans
from walltopo.images.packing import pack_rows

Floats = NDArray[np.float64]

_MAX_ATLAS = 16384  # longer side, as of `texture.size`
_OUTSIDE = 0.002  # share of triangles whose texture may wrap around the picture


@dataclass(frozen=True, eq=False)
class MeshFile:
    """The content of a mesh file.

    Parameters
    ----------
    mesh : the surface, connected where corners have the same place; manifold.
    uv : (F, 3, 2) float in [0, 1], origin at the picture's top left; None without a texture.
    picture : (H, W, 3) uint8 sRGB; None without a texture.
    lacks : why the texture is not used; "" with one.
    """

    mesh: Mesh
    uv: Floats | None
    picture: NDArray[np.uint8] | None
    lacks: str


def read_mesh_file(path: Path, unwanted: str = "") -> MeshFile:
    """Return the surface of a file, and its texture if it covers the surface.

    Parameters
    ----------
    unwanted : why the texture is not wanted; "" if it is.

    Raises
    ------
    InputError : the file is missing or damaged, or holds no triangles.
    """
    texture, lacks = not unwanted, unwanted
    parts = _triangle_meshes(path, load_with_trimesh(path, pictures=texture))
    corners = [np.asarray(part.vertices, np.float64)[np.asarray(part.faces)] for part in parts]
    uv = [_uv_of(part) for part in parts] if texture else []
    pictures = [_picture_of(part) for part in parts] if texture else []
    if texture and any(one is None for one in (*uv, *pictures)):
        lacks = "it has none, or not on all of its parts"
    with prefix_errors(path):
        mesh, kept = _mesh_of_triangles(np.concatenate(corners))
    if lacks:
        return MeshFile(mesh, None, None, lacks)
    shifted = [_wrap_coordinates(one) for one in uv if one is not None]
    if any(one is None for one in shifted):
        return MeshFile(mesh, None, None, "it repeats its picture")
    found = [picture for picture in pictures if picture is not None]
    picture, placed = _one_atlas(found, [one for one in shifted if one is not None])
    return MeshFile(mesh, np.concatenate(placed)[kept], picture, "")


def _triangle_meshes(path: Path, loaded: Any) -> list[Any]:
    """Return the triangle meshes of a file in its common frame."""
    import trimesh

    try:
        parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    except Exception as error:  # trimesh raises many kinds for broken files
        raise InputError(f"{path}: cannot be read as a mesh ({error})") from error
    found = [part for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    if not found:
        raise InputError(f"{path}: holds no triangles", "A point cloud must be meshed first.")
    return found


def _mesh_of_triangles(corners: Floats) -> tuple[Mesh, NDArray[np.int64]]:
    """Return the mesh of triangles (F, 3, 3), and the rows of those that have an area.

    Files repeat a vertex for each texture coordinate; the same place is one vertex here.
    """
    flat = corners.reshape(-1, 3)
    if not np.isfinite(flat).all():
        raise InputError("the mesh has vertices that are NaN or infinite")
    vertices, index = np.unique(flat, axis=0, return_inverse=True)
    faces = int32_faces(index.reshape(-1, 3))
    mesh = Mesh(vertices, faces)
    kept = np.flatnonzero(mesh.areas > 0)
    if not len(kept):
        raise InputError("no triangle of the mesh has an area")
    once = np.unique(np.sort(faces[kept], axis=1), axis=0, return_index=True)[1]
    kept = kept[np.sort(once)]
    return split_fans(Mesh(*compact_vertices(vertices, faces[kept]))), kept


def _uv_of(part: Any) -> Floats | None:
    """Return (F, 3, 2) the texture coordinates, origin at the top left; None without any."""
    uv = getattr(part.visual, "uv", None)
    if uv is None or len(uv) != len(part.vertices):
        return None
    found = np.asarray(uv, dtype=np.float64)[:, :2][np.asarray(part.faces)]
    if not np.isfinite(found).all():
        return None
    return np.stack([found[..., 0], 1.0 - found[..., 1]], axis=-1)


def _picture_of(part: Any) -> Any | None:
    """Return the picture (Pillow) of a part's material; None without one."""
    material = getattr(part.visual, "material", None)
    for name in ("baseColorTexture", "image"):
        picture = getattr(material, name, None)
        if picture is not None:
            return picture
    return None


def _wrap_coordinates(uv: Floats) -> Floats | None:
    """Return coordinates moved by whole pictures into [0, 1]; None if many triangles wrap."""
    moved = uv - np.floor(uv.min(axis=1, keepdims=True) + 1e-6)
    wraps = moved.max(axis=(1, 2)) > 1 + 1e-3
    return None if wraps.mean() > _OUTSIDE else np.clip(moved, 0.0, 1.0)


def _one_atlas(pictures: list[Any], uv: list[Floats]) -> tuple[NDArray[np.uint8], list[Floats]]:
    """Return one picture of all pictures, and the texture coordinates in it."""
    for picture in pictures:
        check_picture_size(*picture.size)
    # Parts that share a picture share its place.
    distinct = list({id(picture): picture for picture in pictures}.values())
    number = {id(picture): k for k, picture in enumerate(distinct)}
    sizes = np.array([picture.size for picture in distinct], dtype=np.int64)
    area = float(sizes.prod(axis=1).sum())
    width = max(int(sizes[:, 0].max()), int(np.ceil(np.sqrt(area))))
    places, height = pack_rows(sizes, width)
    factor = min(1.0, _MAX_ATLAS / max(width, height))
    atlas = np.zeros((max(round(height * factor), 1), max(round(width * factor), 1), 3), np.uint8)
    for picture, (left, top), size in zip(distinct, places, sizes, strict=True):
        x, y = round(left * factor), round(top * factor)
        wide, high = (max(round(float(side) * factor), 1) for side in size)
        pixels = np.asarray(picture.convert("RGB").resize((wide, high)))
        part = atlas[y : y + high, x : x + wide]
        part[:] = pixels[: part.shape[0], : part.shape[1]]
    whole = np.array([width, height], dtype=np.float64)
    placed = [
        (places[number[id(p)]] + one * sizes[number[id(p)]]) / whole
        for p, one in zip(pictures, uv, strict=True)
    ]
    return atlas, placed
