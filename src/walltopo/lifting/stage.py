"""The stage `lift` of a scan: detections and mesh to instances."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import Instances, Progress, View
from walltopo.lifting import lift
from walltopo.lifting.contract import LiftParams
from walltopo.meshes.ply import read_mesh
from walltopo.scans.detections import read_coco_masks
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import atomic_path, read_json, write_json
from walltopo.scans.model import read_views

__all__ = ["records_of", "run", "write_instances"]


def run(scan: ScanFolder, settings: LiftParams, progress: Progress) -> dict[str, Any]:
    """Lift the scan's detections onto its mesh.

    A scan without a scale is lifted with normalised lengths, whatever the settings say: its unit
    means nothing.
    """
    masks, classes = read_coco_masks(scan.detections)
    views = [view.with_masks(masks.get(view.name, ())) for view in read_views(scan.sparse)]
    if scan.scale.is_file() and not read_json(scan.scale)["metric"] and not settings.normalised:
        progress.note("the scan has no scale: lengths are taken in their normalised form")
        settings = replace(settings, normalised=True)
    instances = lift(read_mesh(scan.mesh), views, settings, progress)
    write_instances(scan.instances, scan.instance_records, instances, views, classes)
    return {
        "instances": len(instances),
        "masks": sum(len(view.masks) for view in views),
        "views": len(views),
        "faces_labelled": int(np.count_nonzero(instances.face_instance)),
    }


def records_of(instances: Instances, views: list[View], classes: dict[int, str]) -> dict[str, Any]:
    """The contents of `instances.json`."""
    faces = np.bincount(instances.face_instance, minlength=1)
    items = [
        {
            "id": record.id,
            "label": record.label,
            "class": classes.get(record.label, str(record.label)),
            "score": round(record.score, 4),
            "votes": {str(label): round(share, 4) for label, share in record.votes.items()},
            "views": [[views[view].name, mask] for view, mask in record.views],
            "faces": int(faces[record.id]),
        }
        for record in instances.records
    ]
    names = {str(label): name for label, name in classes.items()}
    return {"version": 1, "classes": names, "instances": items}


def write_instances(
    npz: Path, json: Path, instances: Instances, views: list[View], classes: dict[int, str]
) -> None:
    """Write `instances.npz` and `instances.json`, each atomically."""
    with atomic_path(npz) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(
            stream, face_instance=instances.face_instance, face_score=instances.face_score
        )
    write_json(json, records_of(instances, views, classes))
