"""Files of the lift command: read meshes, cameras and masks; write a coloured mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instances, Mask, Mesh, View
from walltopo.core.files import atomic_path
from walltopo.geometry.mesh_files import fits_float32, write_ply
from walltopo.images.files import read_indices, read_stored
from walltopo.scans.coco_import import read_coco
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.transforms import read_transforms


def find_cameras(path: Path) -> tuple[Path, int]:
    """Return the cameras at or in a path, and how many models there were to choose from.

    A COLMAP project has its models in `sparse/0`, `sparse/1`, ...; the one with the largest file of
    images is taken. A path without any is returned as it is, for `read_cameras` to reject.
    """
    path = Path(path)
    if not path.is_dir() or _images_of(path):
        return path, 1
    if (path / "transforms.json").is_file():
        return path / "transforms.json", 1
    folders = [
        folder
        for parent in (path, path / "sparse")
        for folder in (parent, *_numbered_files(parent))
    ]
    models = {folder: file.stat().st_size for folder in folders if (file := _images_of(folder))}
    if not models:
        return path, 0
    return max(models, key=lambda folder: models[folder]), len(models)


def _numbered_files(parent: Path) -> list[Path]:
    return sorted(parent.glob("[0-9]*")) if parent.is_dir() else []


def _images_of(folder: Path) -> Path | None:
    """Return the file of images of the COLMAP model in a folder; None without a model."""
    files = (folder / "images.bin", folder / "images.txt")
    return next((file for file in files if file.is_file()), None)


def read_cameras(path: Path, sizes: Mapping[str, tuple[int, int]] | None = None) -> list[View]:
    """Return views without masks from a COLMAP model folder or a `transforms.json`.

    Parameters
    ----------
    sizes : photo name to (width, height) of its masks, for a `transforms.json` without sizes.

    Raises
    ------
    InputError : the path is neither of them, or is unreadable.
    """
    path = Path(path)
    if path.is_dir():
        return read_views(path)
    if path.suffix.lower() == ".json":
        return read_transforms(path, sizes)
    raise InputError(f"{path}: expected a COLMAP model folder or a transforms.json")


def read_masks(path: Path) -> Detections:
    """Return the masks of a COCO file or of a folder of id images, with their sizes and classes.

    In a folder, each PNG holds the masks of one photo, whose name is the PNG's path in the folder:
    pixel values (or palette indices) are object numbers within the photo, 8 or 16 bit, 0 = none.
    All objects get class 1, "object", and score 1.

    Raises
    ------
    InputError : the path is neither of them, or a file in it is unreadable.
    """
    path = Path(path)
    if path.is_file():
        return read_coco(path)
    files = sorted(file for file in path.rglob("*") if file.suffix.lower() == ".png")
    if not files:
        raise InputError(f"{path}: expected a COCO file or a folder of PNG id images")
    masks: dict[str, tuple[Mask, ...]] = {}
    sizes: dict[str, tuple[int, int]] = {}
    for file in files:
        name = file.relative_to(path).as_posix()
        numbers = _numbers_in(file)
        masks[name] = tuple(
            Mask.from_full(numbers == number, 1) for number in np.unique(numbers) if number > 0
        )
        sizes[name] = (numbers.shape[1], numbers.shape[0])
    return Detections(masks, sizes, {1: "object"})


def _numbers_in(file: Path) -> NDArray[Any]:
    """Return the (H, W) object numbers of a PNG; of one with a palette, its indices."""
    indices = read_indices(file)
    image: NDArray[Any] = read_stored(file) if indices is None else indices
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"{file}: expected a single-channel PNG, 8 or 16 bit, with object numbers",
            "Masks drawn in colour cannot be read; a PNG with a palette can.",
        )
    return image


UNLABELLED = (150, 150, 150)


def instance_colours(count: int) -> NDArray[np.uint8]:
    """Return (count + 1, 3) sRGB colours, row 0 grey for no instance; adjacent rows differ."""
    import colorsys

    colours = [UNLABELLED]
    for number in range(count):
        # Steps of the golden ratio around the hue circle stay away from all earlier hues.
        hue = (number * 0.6180339887498949) % 1.0
        light = (0.45, 0.6, 0.35)[number % 3]
        red, green, blue = colorsys.hls_to_rgb(hue, light, 0.85)
        colours.append((round(255 * red), round(255 * green), round(255 * blue)))
    return np.array(colours, dtype=np.uint8)


def coloured_mesh(mesh: Mesh, instances: Instances) -> Mesh:
    """Return the mesh coloured by instance; border vertices are duplicated, one per side."""
    corner = mesh.faces.ravel().astype(np.int64)
    label = np.repeat(instances.face_instance.astype(np.int64), 3)
    key = corner * (int(label.max(initial=0)) + 1) + label
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    colours = instance_colours(int(label.max(initial=0)))
    return Mesh(
        mesh.vertices[corner[first]],
        inverse.reshape(-1, 3).astype(np.int32),
        colours[label[first]],
    )


def write_coloured(folder: Path, mesh: Mesh, instances: Instances) -> list[Path]:
    """Write `instances.ply` and `instances.glb` into a folder.

    glTF has float32 vertices. A mesh far from the origin is stored about its centre, under a node
    that shifts it back.
    """
    import trimesh

    coloured = coloured_mesh(mesh, instances)
    ply, glb = folder / "instances.ply", folder / "instances.glb"
    write_ply(ply, coloured)
    back = np.eye(4)
    if not fits_float32(mesh.vertices):
        back[:3, 3] = np.round(mesh.vertices.mean(axis=0))
    exported = trimesh.Trimesh(
        coloured.vertices - back[:3, 3],
        coloured.faces,
        vertex_colors=coloured.vertex_colours,
        process=False,
    )
    scene = trimesh.Scene()
    scene.add_geometry(exported, transform=back)
    with atomic_path(glb) as temporary:
        temporary.write_bytes(scene.export(file_type="glb"))
    return [ply, glb]


def table_of(instances: Instances) -> InstanceTable:
    """Return the content of `instances.npz`."""
    return InstanceTable(instances.face_instance, instances.face_score)


def records_of(
    instances: Instances, views: Sequence[View], classes: Mapping[int, str]
) -> InstanceRecords:
    """Return the content of `instances.json`."""
    faces = np.bincount(instances.face_instance, minlength=1)
    items = tuple(
        InstanceRecord(
            id=record.id,
            label=record.label,
            kind=classes.get(record.label, str(record.label)),
            score=round(record.score, 4),
            votes={str(label): round(share, 4) for label, share in record.votes.items()},
            views=tuple((views[view].name, mask) for view, mask in record.views),
            faces=int(faces[record.id]),
        )
        for record in instances.records
    )
    names = {str(label): name for label, name in classes.items()}
    return InstanceRecords(classes=names, instances=items)
