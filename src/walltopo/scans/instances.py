"""`instances.npz`, `instances.json` and the triangles that edits relabelled."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.files import atomic_path
from walltopo.scans.document import Count, Document, Label, Share, read_arrays


@dataclass(frozen=True, eq=False)
class InstanceTable:
    """`instances.npz`.

    Parameters
    ----------
    face_instance : (F,) int32, 0 = none; in the order of the faces of `mesh.ply`.
    face_score : (F,) float32 in [0, 1].
    """

    face_instance: NDArray[np.int32]
    face_score: NDArray[np.float32]

    @classmethod
    def load(cls, path: Path) -> InstanceTable:
        """Return the checked table of a file.

        Raises
        ------
        InputError : the file is missing or damaged, or its arrays are invalid.
        """
        labels, scores = read_arrays(path, "face_instance", "face_score")
        if labels.ndim != 1 or labels.shape != scores.shape:
            raise InputError(
                f"{path}: face_instance and face_score must both be (F,), got "
                f"{labels.shape} and {scores.shape}"
            )
        if labels.dtype.kind not in "iu" or not _within(labels, np.iinfo(np.int32).max):
            raise InputError(f"{path}: face_instance must be whole numbers >= 0")
        if scores.dtype.kind != "f" or not _within(scores, 1):
            raise InputError(f"{path}: face_score must be numbers in [0, 1]")
        return cls(labels.astype(np.int32), scores.astype(np.float32))

    def save(self, path: Path) -> None:
        """Write the file, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(
                stream, face_instance=self.face_instance, face_score=self.face_score
            )

    def edited_labels(self, changes: Relabelled | None) -> NDArray[np.int32]:
        """Return (F,) labels with the changes of edits, if there are any.

        Raises
        ------
        InputError : as in `Relabelled.on`.
        """
        return self.face_instance if changes is None else changes.on(self.face_instance)

    def check_fits(self, mesh: Mesh) -> None:
        """Raise InputError if the instances belong to another mesh.

        Raises
        ------
        InputError : the mesh has another number of triangles.
        """
        if len(self.face_instance) != len(mesh.faces):
            raise InputError(
                f"instances.npz labels {len(self.face_instance)} triangles, mesh.ply has "
                f"{len(mesh.faces)}",
                "The files are from different runs; run the scan again with --from lift.",
            )


def _within(values: NDArray[Any], limit: float) -> bool:
    """Return whether all values lie in [0, limit]; NaN does not."""
    return bool(((values >= 0) & (values <= limit)).all())


class InstanceRecord(msgspec.Struct, frozen=True, omit_defaults=True):
    """The record of one instance.

    Parameters
    ----------
    id : the value in `face_instance`.
    label : class id; kind : its name ("class" in the file).
    score : the lift's score in [0, 1], 0 if no mask was lifted to it.
    votes : share of the votes by class id.
    views : photo name and number of the mask, for every mask that supports it.
    faces : number of its triangles.
    evidence : probability that it is a hold, by masks, relief and colour together; None if only
        masks were used.
    """

    id: Label
    label: Label
    kind: str = msgspec.field(name="class")
    score: Share
    votes: dict[str, Share]
    views: tuple[tuple[str, Count], ...]
    faces: Count
    evidence: Share | None = None

    @classmethod
    def without_masks(cls, number: int, label: int, kind: str) -> InstanceRecord:
        """Return the record of an instance that no mask supports, still without triangles."""
        return cls(number, label, kind, score=0.0, votes={}, views=(), faces=0)

    @property
    def confidence(self) -> float:
        """Return the score for ranking: the evidence, else the lift's score."""
        return self.score if self.evidence is None else self.evidence


class InstanceRecords(Document, frozen=True, kw_only=True):
    """`instances.json`.

    Parameters
    ----------
    classes : class name by class id.
    instances : in the order of ids.
    """

    classes: dict[str, str]
    instances: tuple[InstanceRecord, ...]

    @property
    def labels(self) -> dict[str, int]:
        """Return the class id by class name."""
        return {name: int(label) for label, name in self.classes.items()}


_MAX = np.iinfo(np.int32).max


@dataclass(frozen=True, eq=False)
class Relabelled:
    """The changes against `instances.npz`.

    Parameters
    ----------
    face : (n,) int32, triangles of `mesh.ply`, ascending.
    label : (n,) int32, the new hold of each triangle, 0 = wall.
    """

    face: NDArray[np.int32]
    label: NDArray[np.int32]

    @classmethod
    def between(cls, before: NDArray[np.int32], after: NDArray[np.int32]) -> Relabelled | None:
        """Return the change of (F,) labels, or None without a change."""
        face = np.flatnonzero(before != after)
        return cls(face.astype(np.int32), after[face]) if len(face) else None

    @classmethod
    def load(cls, path: Path) -> Relabelled:
        """Return the checked table of a file.

        Raises
        ------
        InputError : the file is missing or damaged, or its arrays are invalid.
        """
        face, label = read_arrays(path, "face", "label")
        if face.ndim != 1 or face.shape != label.shape:
            raise InputError(
                f"{path}: face and label must both be (n,), got {face.shape} and {label.shape}"
            )
        for name, values in (("face", face), ("label", label)):
            if values.dtype.kind not in "iu" or not ((values >= 0) & (values <= _MAX)).all():
                raise InputError(f"{path}: {name} must be whole numbers >= 0")
        return cls(face.astype(np.int32), label.astype(np.int32))

    def save(self, path: Path) -> None:
        """Write the file, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(stream, face=self.face, label=self.label)

    def on(self, labels: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return a copy of (F,) labels with the changes.

        Raises
        ------
        InputError : the mesh lacks a triangle of the changes.
        """
        if int(self.face.max(initial=-1)) >= len(labels):
            raise InputError(
                f"relabelled.npz labels triangle {int(self.face.max())}, the mesh has "
                f"{len(labels)}",
                "The files are from different runs; run the scan again with --from edit.",
            )
        changed = labels.copy()
        changed[self.face] = self.label
        return changed
