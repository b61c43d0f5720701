"""Files of the lift: meshes, cameras and masks in; a coloured mesh out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Instances, Mask, Mesh, View
from walltopo.core.errors import naming
from walltopo.core.files import atomic_path, check_name, read_json
from walltopo.core.mask import MOST_SIDE
from walltopo.geometry.ply import write_ply
from walltopo.images.files import read_stored
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import read_coco_masks
from walltopo.scans.document import Coordinate, check_once, parse
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable

Row = tuple[Coordinate, Coordinate, Coordinate, Coordinate]

Pixels = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]

Side = Annotated[float, msgspec.Meta(ge=1, le=MOST_SIDE)]  # some write 1280.0

# OpenGL cameras look along -z with y up, COLMAP's along +z with y down.
_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


class _Frame(msgspec.Struct, frozen=True):
    """A frame of a `transforms.json`, with what the file says of all frames."""

    file_path: str
    transform_matrix: Annotated[tuple[Row, ...], msgspec.Meta(min_length=3, max_length=4)]
    w: Side
    h: Side
    fl_x: Pixels | None = None
    fl_y: Pixels | None = None
    camera_angle_x: Annotated[float, msgspec.Meta(gt=0, lt=3.14)] | None = None
    cx: Pixels | None = None
    cy: Pixels | None = None
    k1: Coordinate = 0.0
    k2: Coordinate = 0.0
    k3: Coordinate = 0.0
    k4: Coordinate = 0.0
    p1: Coordinate = 0.0
    p2: Coordinate = 0.0
    camera_model: str = ""


def read_cameras(path: Path) -> list[View]:
    """Views without masks from a COLMAP model folder or a `transforms.json`.

    Raises
    ------
    InputError : neither, or unreadable.
    """
    path = Path(path)
    if path.is_dir():
        return read_views(path)
    if path.suffix.lower() == ".json":
        return read_transforms(path)
    raise InputError(f"{path}: expected a COLMAP model folder or a transforms.json")


def read_transforms(path: Path) -> list[View]:
    """Views of a NeRF-style `transforms.json` (Instant-NGP, nerfstudio), sorted by name.

    `transform_matrix` is world_from_camera in OpenGL's axes; intrinsics are per file or per
    frame: `w`, `h`, `fl_x`, `fl_y`, `cx`, `cy`, `k1`, `k2`, `p1`, `p2` (fisheye: `k1` to `k4`),
    or `camera_angle_x` where there is no focal length.
    """
    data = read_json(path)
    if not isinstance(data, dict) or not isinstance(data.get("frames"), list) or not data["frames"]:
        raise InputError(f"{path}: not a transforms.json, it has no frames")
    views: list[View] = []
    for number, frame in enumerate(data["frames"]):
        merged = {**data, **frame} if isinstance(frame, dict) else frame
        where = f"{path}: frame {number}"
        entry = parse(merged, _Frame, where)
        with naming(where):
            views.append(_view(entry))
    with naming(path):
        check_once("a photo called", (view.name for view in views))
    return sorted(views, key=lambda view: view.name)


def _view(frame: _Frame) -> View:
    world_from_gl = np.eye(4)
    world_from_gl[: len(frame.transform_matrix)] = frame.transform_matrix
    if not np.allclose(world_from_gl[3], [0, 0, 0, 1]):
        raise InputError("transform_matrix: its last row must be 0 0 0 1")
    volume = float(np.linalg.det(world_from_gl[:3, :3]))
    if not 1e-12 < volume < 1e12:
        what = "mirrors" if volume < 0 else "does not turn"
        raise InputError(
            f"transform_matrix {what} (determinant {volume:.3g}); expected a rotation and a place",
            "A camera that is mirrored has an axis turned over: check the exporter's convention.",
        )
    # Some exporters leave a scale in the matrix: a rotation has none.
    world_from_gl[:3, :3] /= np.cbrt(volume)
    cam_from_world = np.asarray(np.linalg.inv(world_from_gl @ _FLIP)[:3], dtype=np.float64)
    return View(check_name(Path(frame.file_path).name), _camera_of(frame), cam_from_world)


def _camera_of(frame: _Frame) -> Camera:
    width, height = frame.w, frame.h
    if frame.fl_x is not None:
        fx = frame.fl_x
    elif frame.camera_angle_x is not None:
        fx = width / 2 / float(np.tan(frame.camera_angle_x / 2))
    else:
        raise InputError("has neither fl_x nor camera_angle_x")
    fy = fx if frame.fl_y is None else frame.fl_y
    cx = width / 2 if frame.cx is None else frame.cx
    cy = height / 2 if frame.cy is None else frame.cy
    last = (frame.k3, frame.k4)
    model = "OPENCV_FISHEYE" if frame.camera_model == "OPENCV_FISHEYE" else "OPENCV"
    if model == "OPENCV":
        last = (frame.p1, frame.p2)
    return Camera(model, int(width), int(height), (fx, fy, cx, cy, frame.k1, frame.k2, *last))


def read_masks(path: Path) -> tuple[dict[str, tuple[Mask, ...]], dict[int, str]]:
    """Masks by photo name, and class names, of a COCO file or a folder of id images.

    In a folder each PNG is a photo's masks: pixel values are object numbers within that photo
    (8 or 16 bit), 0 = none; all become class 1, "object", with score 1.
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
            f"{file}: expected a PNG of one channel, 8 or 16 bit, with object numbers",
            "A coloured picture of masks cannot be used: colours are not numbers.",
        )
    ids: NDArray[Any] = np.unique(image)
    return tuple(Mask.from_full(image == number, 1) for number in ids[ids > 0])


def attach_masks(views: Sequence[View], masks: Mapping[str, Sequence[Mask]]) -> list[View]:
    """Give each view its masks: by file name, else by file name without folder and suffix.

    Raises
    ------
    InputError : no photo of the masks is among the views.
    """
    by_stem = {Path(name).stem: tuple(items) for name, items in masks.items()}
    result, met = [], 0
    for view in views:
        found = masks.get(view.name, by_stem.get(Path(view.name).stem))
        met += found is not None
        result.append(view.with_masks(tuple(found or ())))
    if masks and met == 0:
        raise InputError(
            f"masks and cameras have no photo in common: masks of {sorted(masks)[0]!r}, "
            f"cameras of {views[0].name!r}",
            "They are matched by file name.",
        )
    return result


UNLABELLED = (150, 150, 150)


def instance_colours(count: int) -> NDArray[np.uint8]:
    """(count + 1, 3) sRGB colours, row 0 grey for no instance; neighbours in number differ."""
    import colorsys

    colours = [UNLABELLED]
    for number in range(count):
        # Steps of the golden ratio around the hue circle never come close to an earlier hue.
        hue = (number * 0.6180339887498949) % 1.0
        light = (0.45, 0.6, 0.35)[number % 3]
        red, green, blue = colorsys.hls_to_rgb(hue, light, 0.85)
        colours.append((round(255 * red), round(255 * green), round(255 * blue)))
    return np.array(colours, dtype=np.uint8)


def coloured_mesh(mesh: Mesh, instances: Instances) -> Mesh:
    """The mesh with sharp colours: vertices at a border are doubled, one for each side."""
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
    """What goes into `instances.npz`."""
    return InstanceTable(instances.face_instance, instances.face_score)


def records_of(
    instances: Instances, views: Sequence[View], classes: Mapping[int, str]
) -> InstanceRecords:
    """What goes into `instances.json`."""
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
