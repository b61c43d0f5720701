"""`relabelled.npz`: the triangles whose label a setter's edits changed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import atomic_path
from walltopo.scans.arrays import read_arrays

__all__ = ["Relabelled"]

_MOST = np.iinfo(np.int32).max


@dataclass(frozen=True, eq=False)
class Relabelled:
    """What differs from `instances.npz`.

    Parameters
    ----------
    face : (n,) int32, triangles of `mesh.ply`, ascending.
    label : (n,) int32, the hold that each belongs to now, 0 = wall.
    """

    face: NDArray[np.int32]
    label: NDArray[np.int32]

    @classmethod
    def between(cls, before: NDArray[np.int32], after: NDArray[np.int32]) -> Relabelled | None:
        """The change of (F,) labels; None where there is none."""
        face = np.flatnonzero(before != after)
        return cls(face.astype(np.int32), after[face]) if len(face) else None

    @classmethod
    def load(cls, path: Path) -> Relabelled:
        """Read.

        Raises
        ------
        InputError : the file is missing or damaged, or its arrays are no such table.
        """
        face, label = read_arrays(path, "face", "label")
        if face.ndim != 1 or face.shape != label.shape:
            raise InputError(
                f"{path}: face and label must both be (n,), got {face.shape} and {label.shape}"
            )
        for name, values in (("face", face), ("label", label)):
            if values.dtype.kind not in "iu" or not ((values >= 0) & (values <= _MOST)).all():
                raise InputError(f"{path}: {name} must be whole numbers >= 0")
        return cls(face.astype(np.int32), label.astype(np.int32))

    def save(self, path: Path) -> None:
        """Write, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, face=self.face, label=self.label)

    def on(self, labels: NDArray[np.int32]) -> NDArray[np.int32]:
        """(F,) labels with the changes; the input stays as it is.

        Raises
        ------
        InputError : it tells of triangles that are not there.
        """
        if int(self.face.max(initial=-1)) >= len(labels):
            raise InputError(
                f"relabelled.npz tells of triangle {int(self.face.max())}, the mesh has "
                f"{len(labels)}",
                "They are of different runs; run the scan again with --from edit.",
            )
        changed = labels.copy()
        changed[self.face] = self.label
        return changed
