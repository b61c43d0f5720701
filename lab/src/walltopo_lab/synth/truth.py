"""The truth files beside the photos: `gt.npz`, `scene.json`, a COLMAP model, masks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mask, View
from walltopo.core.files import atomic_path, read_json, write_json
from walltopo.scans.detections import Detections
from walltopo_lab.synth.bodies import GymInstance
from walltopo_lab.synth.gym import Gym
from walltopo_lab.synth.marks import Tag
from walltopo_lab.synth.measure import plate_record
from walltopo_lab.synth.shade import distorted_rays
from walltopo_lab.synth.two_colours import second_faces

Floats = NDArray[np.float64]

CLASSES = {1: "hold", 2: "volume"}
_LABELS = {"hold": 1, "volume": 2}
# Kinds of facets that are no part of a climbing wall.
_ROOM = ("floor", "plate", "concrete", "ceiling")
_BLOCK = 1024  # faces per visibility block
MIN_MASK_PX = 12  # smaller specks are not annotated, because no annotator would mark them


def masks_of(ids: NDArray[np.int32], instances: Sequence[GymInstance]) -> list[tuple[int, Mask]]:
    """Return (instance id, mask) of all instances in a photo; `ids` (H, W) int32, 0 = none."""
    from scipy.ndimage import find_objects

    height, width = ids.shape
    labels = {item.id: _LABELS[item.label] for item in instances}
    found = []
    for number, box in enumerate(find_objects(ids), start=1):
        if box is None or number not in labels:
            continue
        bitmap = np.ascontiguousarray(ids[box] == number)
        if np.count_nonzero(bitmap) < MIN_MASK_PX:
            continue
        mask = Mask(bitmap, box[1].start, box[0].start, width, height, labels[number], 1.0)
        found.append((number, mask))
    return found


class _Blocks:
    """Points (n, 3) in surface order, grouped in blocks for a coarse visibility test."""

    def __init__(self, points: Floats) -> None:
        starts = np.arange(0, len(points), _BLOCK)
        self._count = len(points)
        low = np.minimum.reduceat(points, starts)
        high = np.maximum.reduceat(points, starts)
        self._centres, self._radii = (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2

    def points_near(self, view: View) -> NDArray[np.intp]:
        """Return indices of the points whose blocks reach into the cone around the photo's view."""
        camera = view.camera
        k1 = camera.distortion[0] if camera.distortion else 0.0
        # The corners are farthest from the axis, and the first row contains two of them.
        row = distorted_rays(
            0, 1, camera.width, 1, camera.fx, camera.cx, camera.cy, k1, np.eye(3)
        ).astype(np.float64)
        widest = np.arctan2(np.hypot(row[:, 0], row[:, 1]), row[:, 2]).max() + 0.02
        x, y, z = view.to_camera(self._centres).T
        # Distance from the cone, for points outside of it.
        away = np.hypot(x, y) * np.cos(widest) - z * np.sin(widest)
        shown = np.flatnonzero(away <= self._radii)
        index = (shown[:, None] * _BLOCK + np.arange(_BLOCK)).ravel()
        return index[index < self._count]


def count_views(
    gym: Gym, camera: Camera, poses: Sequence[NDArray[np.float64]]
) -> NDArray[np.int32]:
    """Return (F,) number of photos with each face's centroid in frame and unoccluded."""
    surface = gym.surface
    corners = surface.vertices[surface.faces]
    centroids = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    counts = np.zeros(len(centroids), np.int32)
    blocks = _Blocks(centroids)
    for k, pose in enumerate(poses):
        view = View(str(k), camera, pose)
        index = blocks.points_near(view)
        facing = ((view.centre - centroids[index]) * normals[index]).sum(axis=1) > 0
        index = index[facing]
        pixels = view.project(centroids[index])
        with np.errstate(invalid="ignore"):
            inside = ((pixels >= 0) & (pixels < [camera.width, camera.height])).all(axis=1)
        index = index[inside]
        ray = centroids[index] - view.centre
        length = np.linalg.norm(ray, axis=1)
        way = (ray / length[:, None]).astype(np.float32)
        origins = np.tile(view.centre.astype(np.float32), (len(way), 1))
        distance = gym.tracer.distances(origins, way)
        counts[index[distance > length - 2e-4]] += 1
    return counts


def write_ground_truth(
    path: Path, gym: Gym, camera: Camera, poses: Sequence[NDArray[np.float64]]
) -> None:
    """Write `gt.npz`: mesh, instance per face, views per face, poses, intrinsics; atomic.

    Beyond the format of the shared test data it contains `face_class` (0 none, 1 hold, 2 volume),
    `face_route`, `face_wall` (whether it is climbing wall or on it, and not the room around),
    `face_second` (whether it has its hold's second colour), and `distortion` (k1 of SIMPLE_RADIAL).
    """
    surface = gym.surface
    size = max((item.id for item in gym.instances), default=0) + 1
    classes, routes = np.zeros(size, np.int32), np.full(size, -3, np.int32)
    for item in gym.instances:
        classes[item.id], routes[item.id] = _LABELS[item.label], item.route
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(
            stream,
            vertices=surface.vertices.astype(np.float32),
            faces=surface.faces,
            face_instance=surface.face_instance,
            face_class=classes[surface.face_instance],
            face_route=routes[surface.face_instance],
            face_wall=np.append([facet.kind not in _ROOM for facet in gym.facets], True)[
                surface.face_facet
            ],
            face_second=second_faces(surface, gym.instances),
            face_views=count_views(gym, camera, poses),
            cam_from_world=np.stack(poses),
            intrinsics=np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
            distortion=np.array(camera.distortion),
            size=np.array([camera.width, camera.height]),
        )


def scene_record(gym: Gym, preset: str, photos: Sequence[str]) -> dict[str, Any]:
    """Return the content of `scene.json`."""
    lengths = [
        float(np.ptp(np.concatenate([facet.corners[:, 0] for facet in section.wall])))
        for section in gym.sections
    ]
    return {
        "seed": gym.seed,
        "route_seed": gym.reset.seed if gym.reset else gym.seed,
        "reset": gym.reset.part if gym.reset else "",
        **({"wear": gym.wear.as_dict()} if gym.wear else {}),
        "preset": preset,
        "instances": [
            {
                "id": item.id,
                "class": item.label,
                "kind": item.kind,
                "colour": item.colour,
                "colours": [item.colour, *([item.second.name] if item.second else [])],
                "rgb": [round(float(c), 4) for c in item.rgb],
                "route": item.route,
                "role": item.role,
                "position": [float(v) for v in item.position],
                "normal": [float(v) for v in item.normal],
            }
            for item in gym.instances
        ],
        "tags": [tag_record(tag) for tag in gym.tags],
        "plates": [plate_record(plate) for plate in gym.plates],
        "wall_height_m": gym.settings.height,
        "wall_length_m": sum(lengths),
        "photos": len(photos),
        "photo_names": list(photos),
    }


def tag_record(tag: Tag) -> dict[str, Any]:
    """Return one start tag's entry in `scene.json`; lengths in metres."""
    return {
        "hold": tag.hold,
        "route": tag.route,
        "position": [float(v) for v in tag.position],
        "normal": [float(v) for v in tag.normal],
        "width_m": 2 * float(np.linalg.norm(tag.right)),
        "height_m": 2 * float(np.linalg.norm(tag.up)),
        "shown": round(tag.shown, 3),
    }


def write_cameras(
    path: Path, camera: Camera, poses: Sequence[NDArray[np.float64]], names: Sequence[str]
) -> None:
    """Write a binary COLMAP model: one SIMPLE_RADIAL camera, every photo's true pose, no points."""
    from walltopo.geometry.colmap import pycolmap

    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(
        pycolmap.Camera(
            camera_id=1,
            model=camera.model,
            width=camera.width,
            height=camera.height,
            params=list(camera.params),
        )
    )
    for number, (name, pose) in enumerate(zip(names, poses, strict=True), start=1):
        image = pycolmap.Image(name=name, camera_id=1, image_id=number)
        rigid = pycolmap.Rigid3d(np.ascontiguousarray(pose))
        model.add_image_with_trivial_frame(image, rigid)
    with atomic_path(path) as temporary:
        temporary.mkdir()
        model.write_binary(temporary)


def write_masks(
    path: Path,
    masks: Mapping[str, Sequence[tuple[int, Mask]]],
    size: tuple[int, int],
    info: Mapping[str, Any],
) -> None:
    """Write COCO with RLE; every annotation also carries `instance_id`, the id in `scene.json`."""
    plain = {name: tuple(mask for _, mask in items) for name, items in masks.items()}
    Detections(plain, dict.fromkeys(masks, size), CLASSES).save(path)
    data = read_json(path) | {"info": dict(info)}
    numbers = [number for items in masks.values() for number, _ in items]
    for annotation, number in zip(data["annotations"], numbers, strict=True):
        annotation["instance_id"] = number
    write_json(path, data)
