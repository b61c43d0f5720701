"""The volume at a place that a setter names: a solid that stands out of the wall's panels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.editing.caches import cached
from walltopo.editing.messages import MissingError
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.segment.propose.pieces import Ground
from walltopo.segment.propose.solids import find_solids

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NEAR = 0.05  # metres: maximum distance of the place from a triangle of the solid


def solid_at(snapshot: ScanSnapshot, labels: NDArray[np.int32], at: Floats) -> Ints:
    """Return the (n,) triangles of the solid at a place, without those of instances.

    Parameters
    ----------
    labels : (F,) int32, 0 = wall.
    at : (3,) world frame.

    Raises
    ------
    MissingError : nothing of a volume's size stands out of the wall there.
    """
    ground = cached(snapshot, b"ground", lambda: _ground(snapshot))
    rows = np.flatnonzero(snapshot.mesh.measured)
    away = np.linalg.norm(snapshot.mesh.centroids - at, axis=1)
    solids = [rows[solid] for solid in find_solids(ground, labels[rows], ())]
    near = [solid for solid in solids if away[solid].min() <= NEAR * snapshot.unit]
    if not near:
        raise MissingError("no_volume")
    return min(near, key=lambda solid: float(away[solid].min()))


def _ground(snapshot: ScanSnapshot) -> Ground:
    return Ground.of(snapshot.mesh.without_guesses(), snapshot.unit, snapshot.metric, seed=0)
