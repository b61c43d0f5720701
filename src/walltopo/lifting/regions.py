"""Pinholes in the labels of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.meshes.neighbours import patches

__all__ = ["fill_pinholes"]

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]

# A hole this small, against the instance around it, is filled.
PINHOLE = 0.05


def fill_pinholes(neighbours: Ints, areas: Floats, winner: Ints) -> Ints:
    """Give small holes that one cluster encloses to it.

    Holes are regions of faces that some mask lies on but no cluster keeps; where the mesh, or
    what any mask ever touched, ends there, it is no hole.

    Returns
    -------
    (C,) int32, `winner` with the holes filled.
    """
    inverse, regions = patches(neighbours, winner)
    size = np.bincount(inverse, areas, minlength=len(regions))
    around = np.where(neighbours >= 0, winner[neighbours], -2)
    own = winner[:, None]
    # Of every region: the lowest and highest label across its border; -2 where the mesh ends.
    across = around != own
    low = np.full(len(regions), np.iinfo(np.int32).max, dtype=np.int64)
    high = np.full(len(regions), -3, dtype=np.int64)
    region = np.broadcast_to(inverse[:, None], across.shape)
    np.minimum.at(low, region[across], around[across])
    np.maximum.at(high, region[across], around[across])
    total = np.bincount(np.maximum(winner, 0), np.where(winner >= 0, areas, 0.0))
    hole = (winner[regions] < 0) & (low == high) & (high >= 0)
    hole[hole] &= size[hole] <= PINHOLE * total[high[hole]]
    return np.where(hole[inverse], high[inverse], winner).astype(np.int32)
