"""How many photos see each spot of the wall, and where more would help."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, View
from walltopo.core.files import atomic_path
from walltopo.core.parallel import ahead
from walltopo.scans.arrays import read_arrays

Floats = NDArray[np.float64]

THIN = 3  # fewer photos than this do not make a surface one can trust
LONGEST = 320  # pixels of the depth picture that decides what hides what
SLACK = 0.015  # share of the depth by which a spot may lie behind what is drawn


def count_views(mesh: Mesh, views: Sequence[View]) -> NDArray[np.int32]:
    """(F,) int32: photos in which a face's centre is in the picture, unhidden, and faces us."""
    from walltopo.geometry.zbuffer import faces_before, render_part

    centres, normals = mesh.centroids, mesh.normals

    def shown(view: View) -> NDArray[np.int64]:
        camera = view.camera.scaled(LONGEST / max(view.camera.width, view.camera.height))
        _, depth = render_part(mesh, camera, view.cam_from_world)
        rows = faces_before(mesh, camera, view.cam_from_world)
        local = view.to_camera(centres[rows])
        pixel = camera.project(local)
        with np.errstate(invalid="ignore"):
            inside = (pixel >= 0).all(axis=1) & (pixel < [camera.width, camera.height]).all(axis=1)
        faces_us = ((view.centre - centres[rows]) * normals[rows]).sum(axis=1) > 0
        index = np.flatnonzero(inside & faces_us)
        column, row = pixel[index].astype(int).T
        return rows[index[local[index, 2] <= depth[row, column] * (1 + SLACK)]]

    counts = np.zeros(len(mesh.faces), dtype=np.int32)
    for seen in ahead(shown, views):
        counts[seen] += 1
    return counts


def counted_views(mesh: Mesh, views: Sequence[View], cache: Path) -> NDArray[np.int32]:
    """As `count_views`; what was counted for the same mesh and photos is read from `cache`."""
    digest = hashlib.blake2b(mesh.vertices.tobytes(), digest_size=16)
    digest.update(mesh.faces.tobytes())
    for view in views:
        digest.update(repr(view.camera).encode() + view.cam_from_world.tobytes())
    key = np.frombuffer(digest.digest(), dtype=np.uint8)
    with suppress(InputError):
        counts, made_of = read_arrays(cache, "counts", "key")
        if made_of.tobytes() == key.tobytes() and counts.shape == (len(mesh.faces),):
            return counts.astype(np.int32)
    counts = count_views(mesh, views)
    with atomic_path(cache) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, counts=counts, key=key)
    return counts


@dataclass(frozen=True)
class Spot:
    """A place that too few photos see.

    Parameters
    ----------
    centre : (3,) world.
    area : square metres (square units when unscaled) that fewer than `THIN` photos see.
    views : mean number of photos over that area.
    """

    centre: Floats
    area: float
    views: float


def thin_spots(
    centres: Floats,
    areas: Floats,
    counts: NDArray[np.int32],
    right: Floats,
    cell: float,
    most: int = 5,
) -> list[Spot]:
    """The worst cells of a grid over the wall's front, largest thin area first.

    Parameters
    ----------
    centres, areas, counts : per triangle of the climbing surface.
    right : (3,) horizontal direction along the wall.
    cell : side of a cell, world units.
    """
    thin = counts < THIN
    if not thin.any():
        return []
    grid = np.floor(np.stack([centres @ right, centres[:, 2]], axis=-1) / cell).astype(np.int64)
    _, group = np.unique(grid, axis=0, return_inverse=True)
    whole = np.bincount(group, areas)
    bare = np.bincount(group, areas * thin)
    # A cell counts when a fair part of it is thin: every border has a few such triangles.
    worst = [k for k in np.argsort(-bare) if bare[k] > 0.25 * whole[k] and bare[k] > 0.1 * cell**2]
    spots = []
    for k in worst[:most]:
        chosen = thin & (group == k)
        weight = areas[chosen] / areas[chosen].sum()
        centre = (centres[chosen] * weight[:, None]).sum(axis=0)
        spots.append(Spot(centre, float(bare[k]), float((counts[chosen] * weight).sum())))
    return spots
