"""Scenes for the lift's tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.core import Camera, Mask, Mesh, View


class ExactRays:
    """Finds what rays hit by double precision; Embree's rays, which trimesh takes, are float32."""

    def __init__(self, mesh: Any) -> None:
        self._corners = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]

    def intersects_location(
        self, origins: np.ndarray, rays: np.ndarray, *, multiple_hits: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the first hits as trimesh does: places, numbers of the rays and of the triangles.

        By Moeller and Trumbore, every ray with every triangle.
        """
        assert not multiple_hits
        first, second, third = np.moveaxis(self._corners, 1, 0)
        across = np.cross(rays[:, None], third - first)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / (across * (second - first)).sum(axis=-1)
            away = origins[:, None] - first
            u = (away * across).sum(axis=-1) * scale
            turned = np.cross(away, second - first)
            v = (rays[:, None] * turned).sum(axis=-1) * scale
            t = (turned * (third - first)).sum(axis=-1) * scale
            t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
        triangle = t.argmin(axis=1)
        nearest = t[np.arange(len(rays)), triangle]
        hit = np.flatnonzero(np.isfinite(nearest))
        return origins[hit] + rays[hit] * nearest[hit, None], hit, triangle[hit]


@pytest.fixture
def exact_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the reference's rays be exact: rounding must not decide what a random scene shows."""
    from trimesh.ray import ray_pyembree

    monkeypatch.setattr(ray_pyembree, "RayMeshIntersector", ExactRays)


class Maker:
    """Makes random little scenes: a bumpy sheet, cameras before it, blobs as masks."""

    def __call__(
        self, seed: int, views: int = 4, masks: int = 4, distorted: bool = False, cells: int = 14
    ) -> tuple[Mesh, list[View]]:
        rng = np.random.default_rng(seed)
        side = np.linspace(-1, 1, cells + 1)
        x, y = np.meshgrid(side, side)
        z = rng.normal(0, 0.08, x.shape)
        vertices = np.stack([x, y, z], -1).reshape(-1, 3) + rng.normal(0, 0.01, (x.size, 3))
        grid = np.arange(x.size).reshape(x.shape)
        a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
        c, d = grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
        faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        mesh = Mesh(vertices, faces.astype(np.int32))
        return mesh, [self.view(rng, k, masks, distorted) for k in range(views)]

    def view(self, rng: np.random.Generator, number: int, masks: int, distorted: bool) -> View:
        width, height = 96, 72
        if distorted:
            camera = Camera("OPENCV", width, height, (80.0, 78, 48, 36, -0.1, 0.02, 0.004, -0.002))
        else:
            camera = Camera("PINHOLE", width, height, (80.0, 78.0, 48.0, 36.0))
        centre = np.array([*rng.uniform(-0.8, 0.8, 2), -rng.uniform(1.2, 2.5)])
        forward = np.array([*rng.uniform(-0.3, 0.3, 2), 0.0]) - centre
        forward /= np.linalg.norm(forward)
        right = np.cross([0, 1.0, 0], forward)
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        pose = np.column_stack([rotation, -rotation @ centre])
        return View(f"{number}.jpg", camera, pose, tuple(self.mask(rng) for _ in range(masks)))

    def mask(self, rng: np.random.Generator) -> Mask:
        rows, cols = np.mgrid[:72, :96]
        cx, cy, rx, ry = rng.uniform(0, 96), rng.uniform(0, 72), *rng.uniform(4, 22, 2)
        bitmap = ((cols - cx) / rx) ** 2 + ((rows - cy) / ry) ** 2 < 1
        return Mask.from_full(bitmap, int(rng.integers(1, 3)), float(rng.uniform(0.3, 1.0)))


@pytest.fixture(scope="session")
def make_scene() -> Maker:
    """`make_scene(seed, views, masks, distorted)` gives a mesh and views."""
    return Maker()


@pytest.fixture(scope="session")
def three_bumps() -> tuple[Mesh, list[View], np.ndarray]:
    """A sheet with three discs of colour, eight views with exact masks, and the truth."""
    from walltopo.geometry.zbuffer import render_ids

    maker = Maker()
    mesh, views = maker(1, views=8, masks=0, cells=60)
    truth = np.zeros(len(mesh.faces), dtype=np.int32)
    for number, (x, y) in enumerate([(-0.5, -0.4), (0.4, -0.3), (0.0, 0.5)], start=1):
        truth[np.hypot(mesh.centroids[:, 0] - x, mesh.centroids[:, 1] - y) < 0.22] = number
    seen = []
    for view in views:
        ids, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
        objects = np.where(ids >= 0, truth[ids], 0)
        found = [Mask.from_full(objects == n, 1, 0.9) for n in (1, 2, 3) if (objects == n).any()]
        seen.append(view.with_masks(tuple(found)))
    return mesh, seen, truth


@pytest.fixture
def files(three_bumps: tuple[Mesh, list[View], np.ndarray], tmp_path: Path) -> Path:
    """The three bumps as a mesh, a transforms.json and a folder of object numbers from 301 on."""
    import cv2

    from walltopo.geometry.mesh_files import write_ply

    mesh, views, _ = three_bumps
    write_ply(tmp_path / "mesh.ply", mesh)
    (tmp_path / "ids").mkdir()
    frames = []
    for view in views:
        ids = np.zeros((72, 96), dtype=np.uint16)
        for number, mask in enumerate(view.masks, start=1):
            ids[mask.full()] = 300 + number
        cv2.imwrite(str(tmp_path / "ids" / f"{Path(view.name).stem}.png"), ids)
        pose = np.vstack([view.cam_from_world, [0, 0, 0, 1]])
        gl = np.linalg.inv(pose) @ np.diag([1.0, -1.0, -1.0, 1.0])
        frames.append({"file_path": f"images/{view.name}", "transform_matrix": gl.tolist()})
    camera = {"w": 96, "h": 72, "fl_x": 80.0, "fl_y": 78.0, "cx": 48.0, "cy": 36.0}
    (tmp_path / "transforms.json").write_text(json.dumps({**camera, "frames": frames}))
    return tmp_path
