"""Instances from the lift and from what stands out of the wall, with evidence for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from msgspec.structs import replace as changed

from walltopo.core import Mesh, Progress, View
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.scale import TYPICAL_HOLD, unit_of_sizes
from walltopo.segment.propose.evidence import explained, shipped_model
from walltopo.segment.propose.pieces import Ground, Pieces, gather_pieces, masks_of
from walltopo.segment.propose.settings import ProposeSettings
from walltopo.segment.propose.tint import sights

VOLUME_AREA, VOLUME_FLATNESS = 0.05, 0.75  # square metres; share of a volume in few planes
# Of what nothing in the photos explains: below what is shown, whatever its relief.
UNEXPLAINED = 0.3


def propose(
    table: InstanceTable,
    records: InstanceRecords,
    whole: Mesh,
    detections: Detections,
    views: Sequence[View],
    photos: PhotoSet,
    metric: bool,
    settings: ProposeSettings,
    progress: Progress,
) -> tuple[InstanceTable, InstanceRecords, Metrics]:
    """Return the lift's instances and what stands out of the wall, with the evidence for each.

    Metrics: instances, those of them that no mask was lifted to, those that relief reshaped.
    """
    table.check_fits(whole)
    if not settings.relief or not len(whole.faces):
        return table, records, {"instances": len(records.instances), "proposed": 0}
    mesh = whole.without_guesses()
    measured = table.face_instance[whole.measured]
    said = masks_of(records.instances, detections)
    sizes = np.sqrt(np.bincount(measured, mesh.areas)[1:])
    unit = unit_of_sizes(sizes.tolist(), metric, TYPICAL_HOLD)
    progress.step("finding the wall's panels")
    ground = Ground.of(mesh, unit, metric, settings.seed)
    seen = sights(mesh, views, photos, progress)
    pieces = gather_pieces(ground, measured, said, settings.sure, seen)
    evidence = _evidence(pieces)
    kept = {
        number
        for number in pieces.ids
        if number not in pieces.new or evidence[number] >= settings.listed
    }
    rows = _records(pieces, records, evidence, kept)
    return (
        _table(whole, pieces, table, evidence, kept),
        changed(records, instances=tuple(rows)),
        {
            "instances": len(rows),
            "proposed": len(kept & pieces.new),
            "reshaped": len(pieces.joined),
        },
    )


def _evidence(pieces: Pieces) -> dict[int, float]:
    """How likely each piece is a hold."""
    if not pieces.ids:
        return {}
    chances = shipped_model().probability(pieces.cues())
    return {
        number: float(chance)
        if explained(pieces.relief[number], pieces.masks[number], pieces.tint[number])
        else min(float(chance), UNEXPLAINED)
        for number, chance in zip(pieces.ids, chances, strict=True)
    }


def _records(
    pieces: Pieces, records: InstanceRecords, evidence: dict[int, float], kept: set[int]
) -> list[InstanceRecord]:
    """The lift's records with the evidence, and those of what is new."""
    faces = np.bincount(pieces.label, minlength=1)
    masks = {record.id: record.views for record in records.instances}
    rows = []
    for record in records.instances:
        if record.id in evidence:  # else it is one with another
            others = pieces.joined.get(record.id, ())
            views = sum((masks[one] for one in others), record.views)
            chance = round(evidence[record.id], 4)
            number = int(faces[record.id])
            rows.append(changed(record, views=views, evidence=chance, faces=number))
    labels = {name: int(label) for label, name in records.classes.items()}
    for number in sorted(kept & pieces.new):
        relief = pieces.relief[number]
        large = relief.area > VOLUME_AREA and relief.flatness > VOLUME_FLATNESS
        kind = "volume" if large and "volume" in labels else "hold"
        rows.append(
            InstanceRecord(
                id=number,
                label=labels.get(kind, 1),
                kind=kind,
                score=0.0,
                votes={},
                views=(),
                faces=int(faces[number]),
                evidence=round(evidence[number], 4),
            )
        )
    return rows


def _table(
    mesh: Mesh,
    pieces: Pieces,
    table: InstanceTable,
    evidence: dict[int, float],
    kept: set[int],
) -> InstanceTable:
    """The labels of the whole mesh; guesses stay with the lift's instances."""
    label = np.where(np.isin(pieces.label, sorted(kept)), pieces.label, 0).astype(np.int32)
    surety = np.zeros(int(label.max(initial=0)) + 1, dtype=np.float32)
    for number in kept:
        surety[number] = evidence[number]
    labels, scores = table.face_instance.copy(), table.face_score.copy()
    rows = np.flatnonzero(mesh.measured)
    other = label != labels[rows]
    labels[rows] = label
    scores[rows[other]] = surety[label[other]]
    return replace(table, face_instance=labels, face_score=scores)
