"""A triangulation of a rim: the best one over its own vertices, whatever its shape.

Liepa, "Filling holes in meshes", 2003, section 3: of all ways to triangulate the rim the one whose
largest dihedral angle is smallest, those towards the mesh around included, and of these the one of
least area; by dynamic programming over the rim's chords (Barequet and Sharir 1995).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.kernels import kernel

__all__ = ["triangulate_rim"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Dihedral angles are told apart by this much of their fold (1 - cosine): below it, area decides.
_FOLD_STEP = 0.1
# The fold at which a triangle lies back on its neighbour.
_FOLDED = 1.98


@kernel
def _best_thirds(points: Floats, outer: Floats, barred: NDArray[np.bool_]) -> Ints:
    """(n, n) the third vertex over chord i < j, -1 = none is possible.

    Parameters
    ----------
    points : (n, 3), the rim in the direction of the mesh's own edges.
    outer : (n, 3) unit normal of the mesh's face at edge k, k + 1.
    barred : (n, n) chords that the mesh already has as edges.
    """
    n = len(points)
    third = np.full((n, n), -1, dtype=np.int64)
    # Symmetric, so that both ways of reading run along memory.
    fold = np.zeros((n, n), dtype=np.float32)
    area = np.zeros((n, n), dtype=np.float32)
    normal = np.zeros((n, n, 3), dtype=np.float32)
    for i in range(n - 1):
        for axis in range(3):
            normal[i, i + 1, axis] = normal[i + 1, i, axis] = outer[i, axis]
    for span in range(2, n):
        for i in range(n - span):
            j = i + span
            last = span == n - 1
            best_fold, best_area, best = np.float32(9.0), np.float32(np.inf), -1
            bx, by, bz = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            ux, uy, uz = (points[j, 0] - points[i, 0], points[j, 1] - points[i, 1],
                          points[j, 2] - points[i, 2])  # fmt: skip
            if last or not barred[i, j]:
                for k in range(i + 1, j):
                    worst = max(fold[i, k], fold[j, k])
                    if worst > best_fold:
                        continue
                    vx, vy, vz = (points[k, 0] - points[i, 0], points[k, 1] - points[i, 1],
                                  points[k, 2] - points[i, 2])  # fmt: skip
                    # of the face (j, k, i)
                    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                    size = np.sqrt(nx * nx + ny * ny + nz * nz)
                    if size <= 1e-30:
                        continue
                    nx, ny, nz = nx / size, ny / size, nz / size
                    a = 1.0 - (nx * normal[i, k, 0] + ny * normal[i, k, 1] + nz * normal[i, k, 2])
                    b = 1.0 - (nx * normal[j, k, 0] + ny * normal[j, k, 1] + nz * normal[j, k, 2])
                    turn = max(a, b)
                    if last:
                        turn = max(turn, 1.0 - (nx * outer[n - 1, 0] + ny * outer[n - 1, 1]
                                                + nz * outer[n - 1, 2]))  # fmt: skip
                    if turn > _FOLDED:
                        continue
                    worst = max(worst, np.float32(np.floor(turn / _FOLD_STEP) * _FOLD_STEP))
                    total = area[i, k] + area[j, k] + np.float32(0.5 * size)
                    if worst < best_fold or (worst == best_fold and total < best_area):
                        best_fold, best_area, best = worst, total, k
                        bx, by, bz = np.float32(nx), np.float32(ny), np.float32(nz)
            third[i, j] = best
            fold[i, j], fold[j, i] = best_fold, best_fold
            area[i, j], area[j, i] = best_area, best_area
            normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = bx, by, bz
            normal[j, i, 0], normal[j, i, 1], normal[j, i, 2] = bx, by, bz
    return third


def triangulate_rim(
    points: Floats, outer: Floats, barred: NDArray[np.bool_]
) -> NDArray[np.int64] | None:
    """Faces over a rim, without new vertices.

    Parameters
    ----------
    points : (n, 3) float, the rim in the direction of the mesh's own edges.
    outer : (n, 3) unit normal of the mesh's face at the edge from vertex k to the next.
    barred : (n, n) bool, pairs of rim vertices that a further edge may not join.

    Returns
    -------
    (n - 2, 3) indices into the rim, wound as the mesh; None where every way is barred.
    """
    third = _best_thirds(points, outer, barred)
    faces, chords = [], [(0, len(points) - 1)]
    while chords:
        i, j = chords.pop()
        if j - i < 2:
            continue
        k = int(third[i, j])
        if k < 0:
            return None
        faces.append((j, k, i))
        chords += [(i, k), (k, j)]
    return np.array(faces, dtype=np.int64)
