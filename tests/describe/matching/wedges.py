"""A wall with four wedges that turn and move between its scans."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.describe.matching.patches import TexturedWall
from walltopo.geometry.mesh_files import write_ply
from walltopo.geometry.rays import Bvh
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.instances import InstanceTable
from walltopo.scans.pictures import TextureUv
from walltopo.scans.scale import Scale

Floats = NDArray[np.float64]
_CELL = 0.0025  # metres, of the walls' grid
_PLACES = np.array([[0.4, 0.4], [1.0, 0.4], [0.4, 1.0], [1.0, 1.0]])


def wall_with(turns: list[float], shifts: Floats, unit: float = 1.0) -> TexturedWall:
    """A wall in the plane y = 0 with four wedges, of which each is turned and shifted.

    The climber looks along +y: x is to the right, z up; turns in degrees, counter-clockwise.
    """
    side = np.arange(0, 1.4, _CELL)
    x, z = np.meshgrid(side, side)
    height, labels = np.zeros(x.shape), np.zeros(x.shape, np.int32)
    colour = np.full((*x.shape, 3), 150.0)
    for number, (place, turn, shift) in enumerate(zip(_PLACES, turns, shifts, strict=True), 1):
        away = np.stack([x, z], axis=-1) - place - shift
        cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        u, v = away @ [cos, sin], away @ [-sin, cos]
        inside = (np.abs(u) < 0.09) & (np.abs(v) < 0.03 + 0.3 * (u + 0.09) * (u > 0))
        height[inside] = (0.03 + 0.2 * (v + 0.06))[inside]
        labels[inside] = number
        colour[inside] = [200, 40, 40]
    vertices = np.stack([x, -height, z], axis=-1).reshape(-1, 3) * unit
    n = len(side)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)[None]).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + n], axis=1)]
        + [np.stack([corner + 1, corner + n + 1, corner + n], axis=1)]
    ).astype(np.int32)
    grid = np.stack([x, side.max() - z], axis=-1).reshape(-1, 2) / side.max()
    mesh = Mesh(vertices, faces)
    texture = colour[::-1].astype(np.uint8)
    return TexturedWall(
        mesh,
        Bvh(mesh.vertices, mesh.faces),
        labels.ravel()[faces].max(axis=1),
        grid[faces].astype(np.float32),
        texture,
        unit,
    )


def holds_of(shifts: Floats, unit: float = 1.0) -> list[Hold]:
    places = np.column_stack([_PLACES + shifts, np.full(4, -0.02)])[:, [0, 2, 1]] * unit
    return [
        Hold(number, "hold", position=(x, y, z), normal=(0.0, -1.0, 0.0), size=0.2 * unit)
        for number, (x, y, z) in enumerate(places.tolist(), 1)
    ]


def save_scan(root: Path, turns: list[float], shifts: Floats) -> ScanFolder:
    """Write a scan of such a wall, as far as holds are compared; return its folder."""
    scan, wall = ScanFolder(root), wall_with(turns, shifts)
    root.mkdir(parents=True, exist_ok=True)
    write_ply(scan.mesh, wall.mesh)
    cv2.imwrite(str(scan.texture), wall.texture[:, :, ::-1])
    TextureUv(wall.uv).save(scan.texture_uv)
    InstanceTable(wall.labels, np.ones(len(wall.labels), np.float32)).save(scan.instances)
    Holds(metric=True, holds=tuple(holds_of(shifts))).save(scan.holds)
    scale = Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True)
    scale.save(scan.scale)
    return scan
