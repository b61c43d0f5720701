"""The stage `lift` of a scan: detections and mesh to instances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from walltopo.core import Instances, View
from walltopo.lifting import lift
from walltopo.lifting.contract import LiftParams, Reads, Writes
from walltopo.scans.context import Context
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable

__all__ = ["records_of", "run", "table_of"]


def run(reads: Reads, settings: LiftParams, context: Context) -> Writes:
    """Lift the scan's detections onto its mesh.

    A scan without a scale is lifted with normalised lengths, whatever the settings say: its unit
    means nothing.
    """
    found = reads.detections
    views = [view.with_masks(found.masks.get(view.name, ())) for view in reads.sparse.views]
    if not reads.scale.metric and not settings.normalised:
        context.progress.note("the scan has no scale: lengths are taken in their normalised form")
        settings = replace(settings, normalised=True)
    instances = lift(reads.mesh, views, settings, context.progress)
    return Writes(
        table_of(instances),
        records_of(instances, views, found.classes),
        {
            "instances": len(instances),
            "masks": sum(len(view.masks) for view in views),
            "views": len(views),
            "faces_labelled": int(np.count_nonzero(instances.face_instance)),
        },
    )


def table_of(instances: Instances) -> InstanceTable:
    """What goes into `instances.npz`."""
    return InstanceTable(instances.face_instance, instances.face_score)


def records_of(
    instances: Instances, views: Sequence[View], classes: Mapping[int, str]
) -> InstanceRecords:
    """What goes into `instances.json`."""
    faces = np.bincount(instances.face_instance, minlength=1)
    items = tuple(
        InstanceRecord(
            id=record.id,
            label=record.label,
            kind=classes.get(record.label, str(record.label)),
            score=round(record.score, 4),
            votes={str(label): round(share, 4) for label, share in record.votes.items()},
            views=tuple((views[view].name, mask) for view, mask in record.views),
            faces=int(faces[record.id]),
        )
        for record in instances.records
    )
    names = {str(label): name for label, name in classes.items()}
    return InstanceRecords(classes=names, instances=items)
