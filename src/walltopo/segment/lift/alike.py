"""Faces of which all views say the same: comparing masks asks one of them for all.

What is compared grows with the square of the views that see a face. But faces that lie well inside
an object are seen by the same views on the same masks: a few hundred kinds of them stand for a
hundred thousand faces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.segment.lift.evidence import Evidence


@dataclass(frozen=True, eq=False)
class Kinds:
    """Faces of the evidence by what views say of them: on which masks, with which shares.

    Parameters
    ----------
    faces : (K,) int32, the first face of each kind.
    areas : (K,) float64, of all faces of the kind.
    """

    faces: NDArray[np.int32]
    areas: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rows:
    """Entries of the evidence by projection.

    Parameters
    ----------
    starts : (P + 1,) int64, where each projection's begin.
    number : (n,) int32, ascending for each projection: which of the faces that were asked for;
        entry : (n,) int64, where in the columns of the evidence.
    """

    starts: NDArray[np.int64]
    number: NDArray[np.int32]
    entry: NDArray[np.int64]


def rows_of(evidence: Evidence, faces: NDArray[np.int32] | None = None) -> Rows:
    """The entries of some faces (of all if None) regrouped by projection."""
    if faces is None:
        faces = np.arange(len(evidence.faces), dtype=np.int32)
    return Rows(*_rows(faces, evidence.starts, evidence.projection, len(evidence.label)))


def kinds_of(evidence: Evidence) -> Kinds:
    """Bring faces together whose entries are equal but for distances."""
    count = len(evidence.faces)
    share = evidence.share.view(np.int32)
    digest = np.zeros(count, dtype=np.uint64)
    in_ranges(_digest, count, evidence.starts, evidence.projection, evidence.view, share, digest)
    return Kinds(
        *_group(digest, evidence.starts, evidence.projection, evidence.view, share, evidence.areas)
    )


@kernel
def _rows(faces: Any, face_starts: Any, projection: Any, count: Any) -> Any:
    starts = np.zeros(count + 1, dtype=np.int64)
    for face in faces:
        for k in range(face_starts[face], face_starts[face + 1]):
            if projection[k] >= 0:
                starts[projection[k] + 1] += 1
    for p in range(count):
        starts[p + 1] += starts[p]
    number = np.zeros(starts[count], dtype=np.int32)
    entry = np.zeros(starts[count], dtype=np.int64)
    place = starts[:-1].copy()
    for n in range(len(faces)):
        for k in range(face_starts[faces[n]], face_starts[faces[n] + 1]):
            p = projection[k]
            if p >= 0:
                number[place[p]], entry[place[p]] = n, k
                place[p] += 1
    return starts, number, entry


@kernel
def _digest(
    begin: Any, end: Any, starts: Any, projection: Any, view: Any, share: Any, digest: Any
) -> None:
    """A number for each face by which equal entries are found; it decides nothing."""
    for face in range(begin, end):
        mixed = np.uint64(starts[face + 1] - starts[face])
        for k in range(starts[face], starts[face + 1]):
            for value in (projection[k], view[k], share[k]):
                mixed = (mixed ^ np.uint64(np.uint32(value))) * np.uint64(0x9E3779B97F4A7C15)
                mixed ^= mixed >> np.uint64(32)
        digest[face] = mixed


@kernel
def _group(digest: Any, starts: Any, projection: Any, view: Any, share: Any, areas: Any) -> Any:
    """First face and area of each kind, in the order of first faces, by open addressing."""
    size = 16
    while size < 2 * len(digest):
        size *= 2
    table = np.full(size, -1, dtype=np.int32)
    faces = np.zeros(len(digest), dtype=np.int32)
    total = np.zeros(len(digest))
    count = 0
    for face in range(len(digest)):
        slot = np.int64(digest[face] & np.uint64(size - 1))
        while table[slot] >= 0 and not _equal(
            faces[table[slot]], face, digest, starts, projection, view, share
        ):
            slot = (slot + 1) & (size - 1)
        if table[slot] < 0:
            table[slot], faces[count] = count, face
            count += 1
        total[table[slot]] += areas[face]
    return faces[:count].copy(), total[:count].copy()


@kernel
def _equal(
    one: Any, other: Any, digest: Any, starts: Any, projection: Any, view: Any, share: Any
) -> Any:
    length = starts[one + 1] - starts[one]
    if digest[one] != digest[other] or length != starts[other + 1] - starts[other]:
        return False
    a, b = starts[one], starts[other]
    for k in range(length):
        if projection[a + k] != projection[b + k] or view[a + k] != view[b + k]:
            return False
        if share[a + k] != share[b + k]:
            return False
    return True
