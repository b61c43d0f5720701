"""A tiny labelled wall, as a generator would write it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh, View


def grid(n: int) -> Mesh:
    """A 2 m square wall in the plane y = 0."""
    x, z = np.meshgrid(np.linspace(0, 2, n + 1), np.linspace(0, 2, n + 1))
    vertices = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + 1, corner + n + 2, corner + n + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Mesh(vertices, faces.astype(np.int32))


def boxes(mesh: Mesh) -> NDArray[np.int32]:
    """Eight square holds: two columns of four, 1.2 m apart."""
    x, _, z = mesh.centroids.T
    face_instance = np.zeros(len(mesh.faces), dtype=np.int32)
    for k in range(8):
        cx, cz = 0.4 + 1.2 * (k // 4), 0.3 + 0.45 * (k % 4)
        face_instance[(abs(x - cx) < 0.08) & (abs(z - cz) < 0.08)] = k + 1
    return face_instance


def write_gym(folder: Path) -> None:
    """Truth, cameras and masks of a tiny wall, as a generator would write them."""
    from walltopo.scans.detections import Detections
    from walltopo_lab.datasets.project import masks_of_view

    mesh = grid(40)
    face_instance = boxes(mesh)
    folder.mkdir(parents=True)
    views = np.full(len(mesh.faces), 4, np.int32)
    np.savez(
        folder / "gt.npz",
        vertices=mesh.vertices,
        faces=mesh.faces,
        face_instance=face_instance,
        face_views=views,
    )
    rows = [
        {
            "id": k + 1,
            "class": "hold",
            "kind": "jug",
            "colour": "red",
            "route": k // 4,
            "position": [0.4 + 1.2 * (k // 4), 0.0, 0.3 + 0.45 * (k % 4)],
            "normal": [0, -1, 0],
        }
        for k in range(8)
    ]
    (folder / "scene.json").write_text(json.dumps({"instances": rows}))
    camera = Camera("PINHOLE", 160, 160, (120.0, 120.0, 80.0, 80.0))
    rotation = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    masks, sizes, lines = {}, {}, []
    for k in range(4):
        centre = np.array([0.7 + 0.2 * k, -1.8, 1.0])
        view = View(f"{k}.jpg", camera, np.column_stack([rotation, -rotation @ centre]))
        labels = dict.fromkeys(range(1, 9), 1)
        masks[view.name] = tuple(m for _, m in masks_of_view(mesh, face_instance, labels, view))
        sizes[view.name] = (160, 160)
        shift = -rotation @ centre
        # A quarter turn about x: quaternion (cos 45, sin 45, 0, 0).
        lines += [
            f"{k + 1} 0.70710678118 0.70710678118 0 0 {shift[0]} {shift[1]} {shift[2]} 1 {k}.jpg",
            "",
        ]
    Detections(masks, sizes, {1: "hold", 2: "volume"}).save(folder / "masks.json")
    (folder / "cameras").mkdir()
    (folder / "cameras/cameras.txt").write_text("1 PINHOLE 160 160 120 120 80 80\n")
    (folder / "cameras/images.txt").write_text("\n".join(lines) + "\n")
    (folder / "cameras/points3D.txt").write_text("")


@pytest.fixture
def make_gym() -> Callable[[Path], None]:
    """Writes truth, cameras and masks of a tiny wall into a folder that does not exist yet."""
    return write_gym
