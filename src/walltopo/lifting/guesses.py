"""Labels of guessed triangles: nothing is lifted onto them, but a hold's own holes belong to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instances, Mesh
from walltopo.meshes.neighbours import face_neighbours, parts

__all__ = ["with_guesses"]


def with_guesses(found: Instances, mesh: Mesh) -> Instances:
    """The labels of the whole mesh, from those of its measured triangles.

    Guessed triangles that hang together get the instance that they lie in, where all measured
    triangles around are of one, with score 0; else none.

    Parameters
    ----------
    found : of `mesh.without_guesses()`.
    """
    label = np.zeros(len(mesh.faces), dtype=np.int32)
    score = np.zeros(len(mesh.faces), dtype=np.float32)
    label[mesh.measured], score[mesh.measured] = found.face_instance, found.face_score
    guessed = np.flatnonzero(~mesh.measured)
    if len(guessed):
        label[guessed] = _enclosing(label, mesh, guessed)
    return Instances(label, score, found.records)


def _enclosing(
    label: NDArray[np.int32], mesh: Mesh, guessed: NDArray[np.int64]
) -> NDArray[np.int32]:
    """(n,) the one label around each guessed face's part, 0 where there are several."""
    part = parts(mesh.faces[guessed])
    across = face_neighbours(mesh.faces)[guessed]
    row, side = np.nonzero(across >= 0)
    other = across[row, side]
    beside = mesh.measured[other]
    around, where = label[other[beside]], part[row[beside]]
    count = int(part.max()) + 1
    low = np.full(count, np.iinfo(np.int32).max, dtype=np.int32)
    high = np.zeros(count, dtype=np.int32)
    np.minimum.at(low, where, around)
    np.maximum.at(high, where, around)
    return np.asarray(np.where(low == high, high, 0)[part], dtype=np.int32)
