"""A scene that has nothing to do with climbing, as another program would have left it.

A table with boxes, balls and mugs, "photographed" from all around, in a unit that nobody knows:

    OUT/table.ply          the mesh
    OUT/sparse             cameras and poses as a COLMAP text model
    OUT/transforms.json    the same as nerfstudio has it
    OUT/ids/000.png ...    one PNG of object numbers a photo; the numbers differ from photo to photo

    python examples/table_scene.py OUT
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import trimesh

from walltopo.core import Camera, View
from walltopo.geometry.zbuffer import render_ids

UNIT = 137.0  # the model's unit is 1/137 m, which the lift does not know


def table(seed: int) -> tuple[trimesh.Trimesh, np.ndarray]:
    """A table top with twelve objects, and the object number of each triangle."""
    rng = np.random.default_rng(seed)
    parts = [trimesh.creation.box((1.6, 1.0, 0.04)).subdivide_to_size(0.03)]
    for k in range(12):
        size = rng.uniform(0.05, 0.09)
        thing = [
            trimesh.creation.box((size, 1.6 * size, 1.2 * size)),
            trimesh.creation.icosphere(subdivisions=3, radius=0.6 * size),
            trimesh.creation.cylinder(radius=0.5 * size, height=1.5 * size),
        ][k % 3].subdivide_to_size(0.02)
        thing.apply_transform(trimesh.transformations.rotation_matrix(k, [0, 0, 1]))
        place = [-0.6 + 0.4 * (k % 4), -0.3 + 0.3 * (k // 4), 0.02 - thing.bounds[0, 2]]
        thing.apply_translation(place + np.append(rng.uniform(-0.05, 0.05, 2), 0.0))
        parts.append(thing)
    owner = np.concatenate([np.full(len(part.faces), k) for k, part in enumerate(parts)])
    return trimesh.util.concatenate(parts), owner


def look_at(number: int, total: int) -> np.ndarray:
    """(4, 4) camera_from_world of one of the cameras on a circle, in metres."""
    angle = 2 * np.pi * number / total
    centre = np.array([1.5 * np.cos(angle), 1.3 * np.sin(angle), 0.9])
    forward = -centre / np.linalg.norm(centre)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = -pose[:3, :3] @ centre
    return pose


def write_colmap(folder: Path, camera: Camera, views: list[View]) -> None:
    """A COLMAP text model without points: the lift wants cameras and poses alone."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = " ".join(str(value) for value in camera.params)
    line = f"1 {camera.model} {camera.width} {camera.height} {numbers}\n"
    (folder / "cameras.txt").write_text(line)
    lines = []
    for number, view in enumerate(views, start=1):
        turn = np.eye(4)
        turn[:3, :3] = view.cam_from_world[:, :3]
        pose = [*trimesh.transformations.quaternion_from_matrix(turn), *view.cam_from_world[:, 3]]
        # Two lines a photo; the second has its points.
        lines += [f"{number} {' '.join(map(repr, map(float, pose)))} 1 {view.name}", ""]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    (folder / "points3D.txt").write_text("")


def write_transforms(path: Path, camera: Camera, views: list[View]) -> None:
    """The cameras as nerfstudio has them: world_from_camera, y up, z backward."""
    frames = []
    for view in views:
        pose = np.vstack([view.cam_from_world, [0.0, 0.0, 0.0, 1.0]])
        gl = np.linalg.inv(pose) @ np.diag([1.0, -1.0, -1.0, 1.0])
        frames.append({"file_path": f"images/{view.name}", "transform_matrix": gl.tolist()})
    fx, fy, cx, cy = camera.params
    intrinsics = {"w": camera.width, "h": camera.height, "fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy}
    path.write_text(json.dumps({**intrinsics, "frames": frames}))


def main(out: Path, photos: int = 16) -> None:
    rng = np.random.default_rng(1)
    mesh, owner = table(seed=4)
    mesh.apply_scale(UNIT)
    (out / "ids").mkdir(parents=True, exist_ok=True)
    mesh.export(out / "table.ply")
    camera = Camera("PINHOLE", 640, 480, (520.0, 520.0, 320.0, 240.0))
    views = []
    for number in range(photos):
        pose = look_at(number, photos)
        pose[:3, 3] *= UNIT
        view = View(f"{number:03d}.png", camera, pose[:3])
        faces, _ = render_ids(mesh.vertices, mesh.faces.astype(np.int32), camera, pose[:3])
        objects = np.where(faces >= 0, owner[faces], 0)
        # Numbers mean nothing across photos, and one object in ten was not found.
        numbers = np.append(0, 1 + rng.permutation(12)) * np.append(1, rng.random(12) > 0.1)
        cv2.imwrite(str(out / "ids" / view.name), numbers[objects].astype(np.uint16))
        views.append(view)
    write_colmap(out / "sparse", camera, views)
    write_transforms(out / "transforms.json", camera, views)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python examples/table_scene.py OUT")
    main(Path(sys.argv[1]))
