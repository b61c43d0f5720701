"""Generated walls for the tests of partial rescans: a plane with boxes for holds."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh, View
from walltopo.scans.holds import Hold

STEP = 0.02  # metres: side of the grid
BUMP = 0.04  # metres: how far a hold stands out
CAMERA = Camera("PINHOLE", 640, 480, (420.0, 420.0, 320.0, 240.0))


@dataclass(eq=False)
class Wall:
    """A wall in the plane y = 0, seen from y < 0, with square holds.

    Parameters
    ----------
    holds : hold id to its centre (x, z) and half its side.
    """

    x: tuple[float, float] = (0.0, 4.0)
    z: tuple[float, float] = (0.0, 2.0)
    holds: dict[int, tuple[float, float, float]] = field(default_factory=dict)

    def mesh(self, noise: float = 0.0, seed: int = 0) -> tuple[Mesh, NDArray[np.int32]]:
        """Return the mesh, its depth with Gaussian noise, and the (F,) labels."""
        xs = np.arange(self.x[0], self.x[1] + 1e-9, STEP)
        zs = np.arange(self.z[0], self.z[1] + 1e-9, STEP)
        grid = np.stack(np.meshgrid(xs, zs, indexing="ij"), axis=-1)
        depth = np.random.default_rng(seed).normal(0, noise, grid.shape[:2])
        for x, z, half in self.holds.values():
            depth[(np.abs(grid - [x, z]) <= half).all(axis=-1)] -= BUMP
        vertices = np.stack([grid[..., 0], depth, grid[..., 1]], axis=-1).reshape(-1, 3)
        index = np.arange(len(vertices), dtype=np.int32).reshape(grid.shape[:2])
        a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
        faces = np.concatenate(
            [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
        )
        mesh = Mesh(vertices, faces)
        labels = np.zeros(len(faces), dtype=np.int32)
        for number, (x, z, half) in self.holds.items():
            near = np.abs(mesh.centroids[:, [0, 2]] - [x, z]) <= half + STEP
            labels[near.all(axis=1)] = number
        return mesh, labels

    def rows(self) -> list[Hold]:
        """Return the rows of the holds."""
        return [
            Hold(
                id=number,
                kind="hold",
                type="jug",
                colour="red",
                position=(x, -BUMP, z),
                normal=(0.0, -1.0, 0.0),
                size=2 * half,
                area=4 * half**2,
                score=0.9,
                photos=("a.jpg",),
            )
            for number, (x, z, half) in self.holds.items()
        ]


def photos_at(*places: tuple[float, float], away: float = 1.5, prefix: str = "new") -> list[View]:
    """Return views straight onto the wall at some (x, z)."""
    views = []
    for number, (x, z) in enumerate(places):
        # Camera x is world x, camera y is world -z, camera z is world y.
        turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
        centre = np.array([x, -away, z])
        pose = np.column_stack([turn, -turn @ centre])
        views.append(View(f"{prefix}{number}.jpg", CAMERA, pose))
    return views


def flat_uv(mesh: Mesh, side: float = 4.0) -> NDArray[np.float32]:
    """Return (F, 3, 2) texture coordinates that unroll the wall into one chart."""
    flat = mesh.vertices[mesh.faces][:, :, [0, 2]] / side
    return np.stack([flat[..., 0], 1 - flat[..., 1]], axis=-1).astype(np.float32)
