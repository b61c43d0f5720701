"""Texture the mesh with OpenMVS's TextureMesh (the `openmvs` backend).

TextureMesh keeps the order of vertices and triangles if it neither decimates nor closes holes.
Every run checks this.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError
from walltopo.geometry.mesh_files import write_ply
from walltopo.images.files import read_rgb
from walltopo.images.fill import fill_gaps
from walltopo.reconstruct.openmvs import (
    find_programs,
    import_scene,
    run_program,
    write_undistorted_workspace,
)
from walltopo.reconstruct.settings import TextureSettings

Image = NDArray[np.uint8]
Corners = NDArray[np.float32]

# OpenMVS chooses the atlas size; the finished atlas is then reduced to the setting.
_UNLIMITED_SIZE = 0
# The fastest packing heuristic: the best one takes hours on the many patches of a fine mesh.
_FASTEST_PACKING = 100
# Photos that neighbouring triangles must share to be textured as one (OpenMVS's advice). Otherwise
# a fine mesh ends in a hundred thousand patches.
_SHARED_PHOTOS = 3
# Unseen triangles are collapsed in the atlas: twice their area is below this, square texels.
_MIN_DOUBLE_AREA = 1e-4
# Larger photos are reduced to this longer side, pixels.
_MAX_PHOTO_SIDE = 8000
_PROPERTIES = [
    *(f"property float32 {axis}" for axis in "xyz"),
    "property list uint8 uint32 vertex_indices",
    "property list uint8 float32 texcoord",
]
_FACE = np.dtype([("n", "u1"), ("vertices", "<i4", 3), ("m", "u1"), ("texcoord", "<f4", 6)])


def texture_arguments(scene: Path, mesh: Path, textured: Path, blend: bool) -> list[str]:
    """Return the arguments of TextureMesh: one atlas, unchanged mesh.

    Parameters
    ----------
    scene, mesh, textured : absolute paths of the .mvs and .ply read and of the .ply written; the
        atlas is written beside the latter.
    blend : level colours between photos and at seams.
    """
    level = str(int(blend))
    return [
        *("-i", str(scene), "-m", str(mesh), "-o", str(textured)),
        *("--decimate", "1", "--close-holes", "0"),
        *("--global-seam-leveling", level, "--local-seam-leveling", level),
        *("--virtual-face-images", str(_SHARED_PHOTOS)),
        *("--patch-packing-heuristic", str(_FASTEST_PACKING)),
        *("--max-texture-size", str(_UNLIMITED_SIZE)),
    ]


def read_corners(path: Path) -> tuple[Mesh, Corners]:
    """Read TextureMesh's mesh and its (F, 3, 2) texture coordinates, origin top left.

    Raises
    ------
    StageError : the file does not have the format of OpenMVS 2.3.
    """
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = head.decode("ascii", "replace").splitlines()
    found = [line for line in lines if line.startswith("property")]
    counts = [int(line.split()[2]) for line in lines if line.startswith("element")]
    if found != _PROPERTIES or len(body) != counts[0] * 12 + counts[1] * _FACE.itemsize:
        raise StageError(f"{path}: not in the format of OpenMVS 2.3; properties: {found}")
    vertices = np.frombuffer(body, np.dtype("<f4"), counts[0] * 3).reshape(-1, 3)
    faces = np.frombuffer(body, _FACE, counts[1], counts[0] * 12)
    corners = faces["texcoord"].reshape(-1, 3, 2) * np.array([1, -1], np.float32) + np.array(
        [0, 1], np.float32
    )
    return Mesh(vertices.astype(np.float64), faces["vertices"]), corners


def openmvs_texture(
    mesh: Mesh,
    sparse: Path,
    photos: Path,
    work: Path,
    settings: TextureSettings,
    progress: Progress,
) -> tuple[Image, Corners, NDArray[np.bool_]]:
    """Texture a mesh with OpenMVS.

    Parameters
    ----------
    mesh : mesh to texture; it stays unchanged.
    sparse, photos : the COLMAP model and the folder of its photos.
    work : an empty folder for intermediate files.
    settings : `size` is the maximum longer side of the atlas; `blend` levels colours.
    progress : receives TextureMesh's percentage.

    Returns
    -------
    image : (H, W, 3) uint8 RGB.
    uv : (F, 3, 2) float32 in [0, 1], origin at the image's top left.
    seen : (F,) bool; unseen triangles take the colour of the nearest seen triangle.

    Raises
    ------
    EnvironmentLacksError : a program is missing.
    StageError : TextureMesh failed, saw nothing, or changed the mesh.
    """
    programs = find_programs(settings.openmvs_bin)
    work = work.resolve()
    write_undistorted_workspace(sparse.resolve(), photos.resolve(), work, _MAX_PHOTO_SIDE, progress)
    scene = import_scene(programs["InterfaceCOLMAP"], work, progress)
    plain, textured = work / "mesh.ply", work / "textured.ply"
    write_ply(plain, mesh)
    arguments = texture_arguments(scene, plain, textured, settings.blend)
    run_program(programs["TextureMesh"], arguments, work, progress)
    result, uv = read_corners(textured)
    if not np.array_equal(result.faces, mesh.faces):
        raise StageError(
            "TextureMesh changed the triangles; its texture does not fit the mesh",
            "Use texture.backend = embedded.",
        )
    image = read_rgb(work / "textured0.png")
    seen = _double_area(uv * _size_of(image)) > _MIN_DOUBLE_AREA
    if not seen.any():
        raise StageError("TextureMesh saw no triangle", "Use texture.backend = embedded.")
    image = fill_gaps(image, _painted_pixels(image, uv[seen]))
    return _reduce_to(image, settings.size), _fill_unseen(mesh, uv, seen), seen


def _size_of(image: Image) -> NDArray[np.float32]:
    """Return (2,) width and height of an image."""
    return np.array(image.shape[1::-1], dtype=np.float32)


def _double_area(texels: Corners) -> NDArray[np.float32]:
    """Return (F,) twice the area of triangles in the atlas, square texels."""
    a, b = texels[:, 1] - texels[:, 0], texels[:, 2] - texels[:, 0]
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _painted_pixels(image: Image, uv: Corners) -> NDArray[np.bool_]:
    """Return (H, W), whether a triangle covers a pixel; the rest has one colour of TextureMesh."""
    result = np.zeros(image.shape[:2], dtype=np.uint8)
    texels = np.rint(uv * _size_of(image) - 0.5).astype(np.int32)
    for triangle in texels:
        cv2.fillConvexPoly(result, triangle, 1)
    return result > 0


def _fill_unseen(mesh: Mesh, uv: Corners, seen: NDArray[np.bool_]) -> Corners:
    """Return the coordinates with unseen triangles at the centroid of the nearest seen triangle."""
    from scipy.spatial import cKDTree

    known = np.flatnonzero(seen)
    _, nearest = cKDTree(mesh.centroids[known]).query(mesh.centroids[~seen])
    result = uv.copy()
    result[~seen] = uv[known[nearest]].mean(axis=1, keepdims=True)
    return result


def _reduce_to(image: Image, size: int) -> Image:
    """Return the image, reduced if its longer side exceeds `size`."""
    scale = size / max(image.shape[:2])
    if scale >= 1.0:
        return image
    smaller = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(smaller, dtype=np.uint8)
