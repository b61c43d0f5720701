"""A mesh whose face colours show hits, misses, false positives and wrong borders."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.core.files import atomic_path
from walltopo.geometry.mesh_files import write_ply


class Outcome(IntEnum):
    """The result of the comparison at one face."""

    WALL = 0
    HIT = 1
    MISSED = 2
    FALSE = 3
    BORDER = 4
    IGNORED = 5


# Colours that red-green blindness leaves distinct: blue, orange, vermilion, yellow of Okabe & Ito.
COLOURS: Mapping[Outcome, tuple[int, int, int]] = {
    Outcome.WALL: (190, 190, 190),
    Outcome.HIT: (0, 158, 115),
    Outcome.MISSED: (0, 114, 178),
    Outcome.FALSE: (213, 94, 0),
    Outcome.BORDER: (240, 228, 66),
    Outcome.IGNORED: (90, 90, 90),
}


def outcome_of_faces(
    predicted: NDArray[np.int32],
    truth: NDArray[np.int32],
    pairs: Mapping[int, int],
    ignored: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Return (F,) an `Outcome` per face.

    Parameters
    ----------
    predicted, truth : (F,) instance ids, 0 = none.
    pairs : predicted id to true id of the matched instances.
    ignored : (F,) faces excluded from the comparison.
    """
    partner = np.zeros(max(int(predicted.max(initial=0)), *pairs, 0) + 1, dtype=np.int64)
    for mine, true in pairs.items():
        partner[mine] = true
    found_true = np.isin(truth, list(pairs.values()))
    expected = partner[predicted]
    result = np.full(len(predicted), Outcome.WALL, dtype=np.int64)
    has_pred, has_truth = predicted > 0, truth > 0
    result[has_pred & (expected > 0)] = Outcome.BORDER
    result[has_truth & found_true] = Outcome.BORDER
    result[has_pred & (expected == 0)] = Outcome.FALSE
    result[has_truth & ~found_true] = Outcome.MISSED
    result[has_pred & has_truth & (expected == truth)] = Outcome.HIT
    result[ignored] = Outcome.IGNORED
    return result


def coloured_mesh(mesh: Mesh, outcomes: NDArray[np.int64]) -> Mesh:
    """Return the mesh with one colour per face; vertices are split only at colour borders."""
    corner = mesh.faces.astype(np.int64) * len(Outcome) + outcomes[:, None]
    pairs, index = np.unique(corner, return_inverse=True)
    table = np.array([COLOURS[outcome] for outcome in Outcome], dtype=np.uint8)
    return Mesh(
        mesh.vertices[pairs // len(Outcome)],
        index.reshape(-1, 3).astype(np.int32),
        table[pairs % len(Outcome)],
    )


def write_errors(mesh: Mesh, folder: Path) -> None:
    """Write a coloured mesh as `errors.ply` and as `errors.glb`, rotated to glTF's y up."""
    import trimesh

    write_ply(folder / "errors.ply", mesh)
    y_up = np.stack([mesh.vertices[:, 0], mesh.vertices[:, 2], -mesh.vertices[:, 1]], axis=1)
    shape = trimesh.Trimesh(
        y_up, mesh.faces, vertex_colors=mesh.vertex_colours, process=False, validate=False
    )
    with atomic_path(folder / "errors.glb") as temporary:
        temporary.write_bytes(shape.export(file_type="glb"))
