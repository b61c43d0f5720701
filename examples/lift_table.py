"""The lift on things that have nothing to do with climbing, in a unit that nobody knows.

Makes a table with boxes, balls and mugs, "photographs" it from all around, writes what another
program would have written (a mesh, a transforms.json, one PNG of object numbers per photo; the
numbers differ from photo to photo), and calls `walltopo lift --normalised` on it.

    python examples/lift_table.py OUT
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import trimesh

from walltopo.cli import main as walltopo
from walltopo.core import Camera, View
from walltopo.raycast import render_ids

UNIT = 137.0  # the model's unit is 1/137 m: the lift is not told


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


def main(out: Path, photos: int = 16) -> int:
    rng = np.random.default_rng(1)
    mesh, owner = table(seed=4)
    mesh.apply_scale(UNIT)
    (out / "ids").mkdir(parents=True, exist_ok=True)
    mesh.export(out / "table.ply")
    camera = Camera("PINHOLE", 640, 480, (520.0, 520.0, 320.0, 240.0))
    frames = []
    for number in range(photos):
        pose = look_at(number, photos)
        pose[:3, 3] *= UNIT
        view = View(f"{number:03d}.png", camera, pose[:3])
        faces, _ = render_ids(mesh.vertices, mesh.faces.astype(np.int32), camera, pose[:3])
        objects = np.where(faces >= 0, owner[faces], 0)
        # Numbers mean nothing across photos, and one object in ten was not found.
        numbers = np.append(0, 1 + rng.permutation(12)) * np.append(1, rng.random(12) > 0.1)
        cv2.imwrite(str(out / "ids" / view.name), numbers[objects].astype(np.uint16))
        gl = np.linalg.inv(pose) @ np.diag([1.0, -1.0, -1.0, 1.0])
        frames.append({"file_path": f"images/{view.name}", "transform_matrix": gl.tolist()})
    cameras = {"w": 640, "h": 480, "fl_x": 520.0, "fl_y": 520.0, "cx": 320.0, "cy": 240.0}
    (out / "transforms.json").write_text(json.dumps({**cameras, "frames": frames}))
    given = ["--mesh", "table.ply", "--cameras", "transforms.json", "--masks", "ids"]
    paths = [text if text.startswith("--") else str(out / text) for text in given]
    return walltopo(["lift", *paths, "-o", str(out / "lifted"), "--normalised"])


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "table-demo")))
