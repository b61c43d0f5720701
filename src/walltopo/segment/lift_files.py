"""Files of the lift command: read meshes, cameras and masks; write a coloured mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instances, Mask, Mesh, View
from walltopo.core.files import atomic_path
from walltopo.geometry.mesh_files import write_ply
from walltopo.images.files import read_stored
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import read_coco_masks
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.transforms import read_transforms


def read_cameras(path: Path) -> list[View]:
    """Return views without masks from a COLMAP model folder or a `transforms.json`.

    Raises
    ------
    InputError : the path is neither of them, or is unreadable.
    """
    path = Path(path)
    if path.is_dir():
        return read_views(path)
    if path.suffix.lower() == ".json":
        return read_transforms(path)
    raise InputError(f"{path}: expected a COLMAP model folder or a transforms.json")


def read_masks(path: Path) -> tuple[dict[str, tuple[Mask, ...]], dict[int, str]]:
    """Return masks by photo name, and class names, from a COCO file or a folder of id images.

    In a folder, each PNG holds the masks of one photo: pixel values are object numbers within the
    photo (8 or 16 bit), 0 = none. All objects get class 1, "object", and score 1.
    """
    path = Path(path)
    if path.is_file():
        return read_coco_masks(path)
    files = sorted(path.glob("*.png")) if path.is_dir() else []
    if not files:
        raise InputError(f"{path}: expected a COCO file or a folder of PNG id images")
    return {file.name: _masks_of_ids(file) for file in files}, {1: "object"}


def _masks_of_ids(file: Path) -> tuple[Mask, ...]:
    image = read_stored(file)
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"{file}: expected a single-channel PNG, 8 or 16 bit, with object numbers",
            "Masks drawn in colour cannot be read.",
        )
    ids: NDArray[Any] = np.unique(image)
    return tuple(Mask.from_full(image == number, 1) for number in ids[ids > 0])


def attach_masks(views: Sequence[View], masks: Mapping[str, Sequence[Mask]]) -> list[View]:
    """Return the views with their masks, matched by file name, else by its stem.

    Raises
    ------
    InputError : no photo of the masks is among the views.
    """
    by_stem = {Path(name).stem: tuple(items) for name, items in masks.items()}
    result, matched = [], 0
    for view in views:
        found = masks.get(view.name, by_stem.get(Path(view.name).stem))
        matched += found is not None
        result.append(view.with_masks(tuple(found or ())))
    if masks and matched == 0:
        raise InputError(
            f"masks and cameras have no photo in common: masks of {sorted(masks)[0]!r}, "
            f"cameras of {views[0].name!r}",
            "Masks and cameras are matched by file name.",
        )
    return result


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
    """Write `instances.ply` and `instances.glb` into a folder."""
    import trimesh

    coloured = coloured_mesh(mesh, instances)
    ply, glb = folder / "instances.ply", folder / "instances.glb"
    write_ply(ply, coloured)
    exported = trimesh.Trimesh(
        coloured.vertices, coloured.faces, vertex_colors=coloured.vertex_colours, process=False
    )
    with atomic_path(glb) as temporary:
        temporary.write_bytes(exported.export(file_type="glb"))
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
