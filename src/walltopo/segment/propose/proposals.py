"""Instances from the lift and from bumps on the wall, with evidence for each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from msgspec.structs import replace as changed

from walltopo.core import Mesh, Progress, View
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.scale import TYPICAL_HOLD, unit_of_sizes
from walltopo.segment.propose.evidence import (
    Masks,
    PhotoView,
    is_explained,
    photo_views,
    shipped_model,
)
from walltopo.segment.propose.pieces import Ground, Pieces, gather_pieces, masks_of
from walltopo.segment.propose.solids import add_volumes
from walltopo.segment.settings import ProposeSettings

# Maximum evidence of a piece that no photo explains: below the limit for being listed.
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
    """Return the lift's instances, the volumes and bumps that no mask shows, and their evidence.

    Metrics: number of instances, of proposed ones (without a mask), and of reshaped ones.
    """
    table.check_fits(whole)
    lifted = len(records.instances)
    if not (settings.volumes or settings.relief) or not whole.measured.any():
        return table, records, {"instances": lifted, "proposed": 0}
    mesh = whole.without_guesses()
    sizes = np.sqrt(np.bincount(table.face_instance[whole.measured], mesh.areas)[1:])
    unit = unit_of_sizes(sizes.tolist(), metric, TYPICAL_HOLD)
    progress.step("find the wall's panels")
    ground = Ground.of(mesh, unit, metric, settings.seed)
    if settings.volumes:
        table, records = add_volumes(ground, table, records, whole.measured, settings.sure)
    volumes = len(records.instances) - lifted
    figures: Metrics = {"instances": lifted + volumes, "proposed": volumes}
    if settings.relief:
        rendered = photo_views(mesh, views, photos, progress)
        table, records, bumps = _with_bumps(
            ground, whole, table, records, detections, rendered, settings
        )
        figures |= bumps | {"proposed": volumes + bumps["proposed"]}
    return table, records, figures


def _with_bumps(
    ground: Ground,
    whole: Mesh,
    table: InstanceTable,
    records: InstanceRecords,
    detections: Detections,
    rendered: Iterable[PhotoView],
    settings: ProposeSettings,
) -> tuple[InstanceTable, InstanceRecords, dict[str, int]]:
    """Return the instances with the bumps of the relief; proposed volumes stay as they are."""
    measured = table.face_instance[whole.measured]
    solid = {row.id: row.evidence for row in records.instances if row.evidence is not None}
    lifted_masks = masks_of(records.instances, detections)
    lifted_masks |= dict.fromkeys(solid, Masks(support=1.0))
    pieces = gather_pieces(ground, measured, lifted_masks, settings.sure, rendered)
    evidence = _hold_probabilities(pieces) | solid
    kept = {
        number
        for number in pieces.ids
        if number not in pieces.new or evidence[number] >= settings.listed
    }
    rows = _make_records(pieces, records, evidence, kept)
    return (
        _label_mesh(whole, pieces, table, evidence, kept),
        changed(records, instances=tuple(rows)),
        {
            "instances": len(rows),
            "proposed": len(kept & pieces.new),
            "reshaped": len(pieces.joined),
        },
    )


def _hold_probabilities(pieces: Pieces) -> dict[int, float]:
    """Return the probability that each piece is a hold."""
    if not pieces.ids:
        return {}
    probabilities = shipped_model().probability(pieces.cues())
    return {
        number: float(probability)
        if is_explained(pieces.relief[number], pieces.masks[number], pieces.tint[number])
        else min(float(probability), UNEXPLAINED)
        for number, probability in zip(pieces.ids, probabilities, strict=True)
    }


def _make_records(
    pieces: Pieces, records: InstanceRecords, evidence: dict[int, float], kept: set[int]
) -> list[InstanceRecord]:
    """Return the lift's records with their evidence, and records of the new pieces."""
    faces = np.bincount(pieces.label, minlength=1)
    masks = {record.id: record.views for record in records.instances}
    rows = []
    for record in records.instances:
        if record.id in evidence:  # an instance without evidence was merged into another
            others = pieces.joined.get(record.id, ())
            views = sum((masks[one] for one in others), record.views)
            probability = round(evidence[record.id], 4)
            number = int(faces[record.id])
            rows.append(changed(record, views=views, evidence=probability, faces=number))
    label = records.labels.get("hold", 1)
    for number in sorted(kept & pieces.new):
        row = InstanceRecord.without_masks(number, label, "hold")
        probability = round(evidence[number], 4)
        rows.append(changed(row, faces=int(faces[number]), evidence=probability))
    return rows


def _label_mesh(
    mesh: Mesh,
    pieces: Pieces,
    table: InstanceTable,
    evidence: dict[int, float],
    kept: set[int],
) -> InstanceTable:
    """Return the labels of the whole mesh; guessed triangles keep the lift's labels."""
    label = np.where(np.isin(pieces.label, sorted(kept)), pieces.label, 0).astype(np.int32)
    confidence = np.zeros(int(label.max(initial=0)) + 1, dtype=np.float32)
    for number in kept:
        confidence[number] = evidence[number]
    labels, scores = table.face_instance.copy(), table.face_score.copy()
    rows = np.flatnonzero(mesh.measured)
    other = label != labels[rows]
    labels[rows] = label
    scores[rows[other]] = confidence[label[other]]
    return replace(table, face_instance=labels, face_score=scores)
