"""A scan's instances as labels, and corrected labels back into the scan."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import atomic_path, read_json, write_json
from walltopo.meshes.ply import read_mesh
from walltopo.scans.folder import ScanFolder
from walltopo_lab.datasets.painted import Painted

__all__ = ["read_scan_labels", "write_scan_labels"]

# A painted face this near a face's centroid gives its label; Blender keeps places to 1e-6.
_NEAR = 1e-3


def read_scan_labels(scan: ScanFolder) -> tuple[NDArray[np.int32], dict[int, int], dict[int, str]]:
    """Face instances, the class id of each instance, and the class names of a scan."""
    if not scan.instances.is_file():
        raise InputError(f"{scan.instances}: no such file", "Run the lift first.")
    with np.load(scan.instances) as archive:
        face_instance = archive["face_instance"].astype(np.int32)
    data = read_json(scan.instance_records)
    classes = {int(k): str(v) for k, v in data["classes"].items()}
    labels = {int(row["id"]): int(row["label"]) for row in data["instances"]}
    return face_instance, labels, classes


def _on_scan(scan: ScanFolder, painted: Painted) -> NDArray[np.int32]:
    """The painted instance of each face of the scan's mesh, by place: exporters reorder faces."""
    from scipy.spatial import cKDTree

    mesh = read_mesh(scan.mesh)
    distance, nearest = cKDTree(painted.mesh.centroids).query(mesh.centroids)
    lost = int((distance > _NEAR).sum())
    if lost > 0.01 * len(mesh.faces):
        raise InputError(
            f"the painted mesh is not the scan's: {lost} of {len(mesh.faces)} faces of "
            f"{scan.mesh} have no painted face within 1 mm",
            "Paint the mesh that `walltopo dataset paint` wrote, and do not move or remesh it.",
        )
    return np.where(distance <= _NEAR, painted.face_instance[nearest], 0).astype(np.int32)


def write_scan_labels(scan: ScanFolder, painted: Painted) -> int:
    """Replace a scan's instances by those of a corrected painted mesh.

    An instance that shares most of its faces with an old one of its class keeps its id, score,
    votes and views; others are new, certain (score 1), and supported by no mask.

    Returns
    -------
    Number of instances written.

    Raises
    ------
    InputError : the painted mesh is another one.
    """
    face_instance = _on_scan(scan, painted)
    old, _, classes = read_scan_labels(scan)
    data = read_json(scan.instance_records)
    records = {int(row["id"]): row for row in data["instances"]}
    free = 1 + max([0, *records])
    result = np.zeros(len(face_instance), dtype=np.int32)
    rows: list[dict[str, Any]] = []
    used: set[int] = set()
    for number in np.unique(face_instance[face_instance > 0]).tolist():
        faces = face_instance == number
        counts = np.bincount(old[faces])
        before, label = int(counts.argmax()), painted.labels[number]
        same = before > 0 and before not in used and counts[before] > 0.5 * faces.sum()
        if same and int(records[before]["label"]) == label:
            row = {**records[before], "faces": int(faces.sum())}
        else:
            row = {"id": free, "label": label, "class": classes[label], "score": 1.0}
            row |= {"votes": {str(label): 1.0}, "views": [], "faces": int(faces.sum())}
            free += 1
        used.add(int(row["id"]))
        result[faces] = row["id"]
        rows.append(row)
    rows.sort(key=lambda row: int(row["id"]))
    with atomic_path(scan.instances) as temporary, temporary.open("wb") as stream:
        score = (result > 0).astype(np.float32)
        np.savez_compressed(stream, face_instance=result, face_score=score)
    write_json(scan.instance_records, {**data, "instances": rows})
    return len(rows)
