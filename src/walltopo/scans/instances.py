"""`instances.npz` and `instances.json`: what the lift found on the mesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.core.files import atomic_path
from walltopo.scans.document import Document

__all__ = ["InstanceRecord", "InstanceRecords", "InstanceTable"]


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
        """Read.

        Raises
        ------
        InputError : the file is missing or damaged.
        """
        try:
            with np.load(path) as data:
                return cls(
                    np.asarray(data["face_instance"], dtype=np.int32),
                    np.asarray(data["face_score"], dtype=np.float32),
                )
        except FileNotFoundError as error:
            raise InputError(f"{path}: no such file", "Run the lift stage first.") from error
        except (KeyError, OSError, ValueError) as error:
            raise InputError(f"{path}: no table of instances ({error})") from error

    def save(self, path: Path) -> None:
        """Write, atomically."""
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            np.savez_compressed(
                stream, face_instance=self.face_instance, face_score=self.face_score
            )

    def check_fits(self, mesh: Mesh) -> None:
        """Refuse a mesh of another run.

        Raises
        ------
        InputError : the mesh has another number of triangles.
        """
        if len(self.face_instance) != len(mesh.faces):
            raise InputError(
                f"instances.npz holds labels of {len(self.face_instance)} triangles, mesh.ply has "
                f"{len(mesh.faces)}",
                "They are of different runs; run the scan again with --from lift.",
            )


class InstanceRecord(msgspec.Struct, frozen=True):
    """What the lift knows of one instance.

    Parameters
    ----------
    id : the value in `face_instance`.
    label : class id; kind : its name ("class" in the file).
    score : in [0, 1]; votes : share of the votes by class id.
    views : photo name and number of the mask, for every mask that supports it.
    faces : number of its triangles.
    """

    id: int
    label: int
    kind: str = msgspec.field(name="class")
    score: float
    votes: dict[str, float]
    views: tuple[tuple[str, int], ...]
    faces: int


class InstanceRecords(Document, frozen=True, kw_only=True):
    """`instances.json`.

    Parameters
    ----------
    classes : class name by class id.
    instances : in the order of ids.
    """

    classes: dict[str, str]
    instances: tuple[InstanceRecord, ...]
