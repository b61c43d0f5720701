"""Define 3D instances: the objects that a mesh's triangles belong to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from walltopo.core.errors import InputError


@dataclass(frozen=True)
class Instance:
    """The class, score and masks of one 3D instance.

    Parameters
    ----------
    id : >= 1; the value in `Instances.face_instance`.
    label : class id, as in the masks.
    score : confidence in [0, 1].
    views : (view index, mask index) of every mask that supports the instance.
    votes : share of the votes by class id; the shares sum to 1.
    """

    id: int
    label: int
    score: float
    views: tuple[tuple[int, int], ...] = ()
    votes: dict[int, float] = field(default_factory=dict[int, float])


@dataclass(frozen=True, eq=False)
class Instances:
    """The instance labels of a mesh's triangles.

    Parameters
    ----------
    face_instance : (F,) int32, 0 = none, else an instance's id.
    face_score : (F,) float32 in [0, 1], support of the face's label; 0 without an instance.
    records : one `Instance` per id, in the order of ids.

    Examples
    --------
    >>> import numpy as np
    >>> labels = np.array([0, 7, 7], dtype=np.int32)
    >>> support = np.array([0.0, 0.8, 0.6], dtype=np.float32)
    >>> found = Instances(labels, support, (Instance(id=7, label=1, score=0.9),))
    >>> len(found), found.faces_of(7).tolist()
    (1, [1, 2])
    """

    face_instance: NDArray[np.int32]
    face_score: NDArray[np.float32]
    records: tuple[Instance, ...]

    def __post_init__(self) -> None:
        if self.face_instance.shape != self.face_score.shape or self.face_instance.ndim != 1:
            raise InputError(
                "instances: face_instance and face_score must both be (F,), got "
                f"{self.face_instance.shape} and {self.face_score.shape}"
            )
        known = {0, *(record.id for record in self.records)}
        stray = set(np.unique(self.face_instance).tolist()) - known
        if stray:
            raise InputError(f"instances: faces have ids without a record: {sorted(stray)[:5]}")

    def __len__(self) -> int:
        return len(self.records)

    def faces_of(self, instance_id: int) -> NDArray[np.int64]:
        """Return the indices of the faces of one instance."""
        return np.flatnonzero(self.face_instance == instance_id)


def triangles_of(
    face_instance: NDArray[np.int32], ids: Iterable[int]
) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Yield id and (n,) ascending triangle indices of each instance that has any.

    Parameters
    ----------
    face_instance : (F,) int32.
    ids : the ids to look for, in the order of the results.
    """
    # A search for ids of another type would convert all labels.
    numbers = np.fromiter(ids, dtype=face_instance.dtype)
    rows = np.flatnonzero(np.isin(face_instance, numbers))
    rows = rows[np.argsort(face_instance[rows], kind="stable")]
    labels = face_instance[rows]
    first, last = np.searchsorted(labels, numbers), np.searchsorted(labels, numbers, "right")
    for number, begin, end in zip(numbers.tolist(), first.tolist(), last.tolist(), strict=True):
        if end > begin:
            yield number, rows[begin:end]
