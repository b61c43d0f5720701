"""Conversion of a scan's instances to labels, and of corrected labels back into the scan."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo_lab.datasets.painted import Painted

# m; a face takes the label of a painted face within this distance of its centroid. Blender keeps
# positions to 1e-6.
_NEAR = 1e-3


def read_scan_labels(scan: ScanFolder) -> tuple[NDArray[np.int32], dict[int, int], dict[int, str]]:
    """Return the face instances, the class id of each instance, and the class names of a scan."""
    records = InstanceRecords.load(scan.instance_records)
    classes = {int(label): name for label, name in records.classes.items()}
    labels = {record.id: record.label for record in records.instances}
    return InstanceTable.load(scan.instances).face_instance, labels, classes


def _on_scan(scan: ScanFolder, painted: Painted) -> NDArray[np.int32]:
    """Return the painted instance of each face of the scan's mesh, matched by position.

    Exporters reorder faces, so that indices cannot be compared.
    """
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
    """Replace a scan's instances with those of a corrected painted mesh.

    An instance that shares most of its faces with an old one of its class keeps its id, score,
    votes and views; others are new, with score 1 and no supporting mask.

    Returns
    -------
    Number of instances written.

    Raises
    ------
    InputError : the painted mesh differs from the scan's mesh.
    """
    face_instance = _on_scan(scan, painted)
    old, _, classes = read_scan_labels(scan)
    stored = InstanceRecords.load(scan.instance_records)
    records = {record.id: record for record in stored.instances}
    free = 1 + max([0, *records])
    result = np.zeros(len(face_instance), dtype=np.int32)
    rows: dict[int, InstanceRecord] = {}
    for number in np.unique(face_instance[face_instance > 0]).tolist():
        faces = face_instance == number
        counts = np.bincount(old[faces])
        before, label = int(counts.argmax()), painted.labels[number]
        same = before > 0 and before not in rows and counts[before] > 0.5 * faces.sum()
        if same and records[before].label == label:
            row = replace(records[before], faces=int(faces.sum()))
        else:
            votes = {str(label): 1.0}
            row = InstanceRecord(free, label, classes[label], 1.0, votes, (), int(faces.sum()))
            free += 1
        result[faces] = row.id
        rows[row.id] = row
    InstanceTable(result, (result > 0).astype(np.float32)).save(scan.instances)
    replace(stored, instances=tuple(rows[k] for k in sorted(rows))).save(scan.instance_records)
    return len(rows)
