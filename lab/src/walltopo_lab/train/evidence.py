"""Fits the model that combines masks, relief and colour into a hold probability.

The model is `models/evidence.json`. The shipped detector finds nearly all holds of generated gyms.
So that the fit also covers its misses, some holds lose all or most of their masks, by a seed.
Pieces that match a true instance at an IoU of 0.5 are holds. Pieces with less than 0.1 of their
area on any instance are not holds. All others are excluded.

The command is `python -m benchmarks.evidence`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, Mesh, Silent, View
from walltopo.geometry.mesh_files import read_mesh
from walltopo.pipeline.settings import Settings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.photos import PhotoSet
from walltopo.segment.lift import lift
from walltopo.segment.lift_files import records_of, table_of
from walltopo.segment.propose.evidence import (
    CUES,
    EvidenceModel,
    Masks,
    PhotoView,
    Weights,
    is_explained,
    photo_views,
)
from walltopo.segment.propose.pieces import Ground, Pieces, gather_pieces, masks_of
from walltopo.segment.settings import ProposeSettings
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import Carried, carry_truth
from walltopo_lab.evaluate.mesh import REACH_M
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth

Floats = NDArray[np.float64]

PATCH = 0.8  # metres: radius of the patches in which all instances lose masks
FEW, KEPT = 0.5, 0.125  # share of spoilt instances that keep masks, and share of masks kept
# Factors on all scores: a detector is less confident on photos unlike its training data.
FADED = (0.5, 1.0)
MET, NONE = 0.5, 0.1
WITHIN = 0.02


@dataclass(frozen=True)
class Spoilt:
    """One way to remove masks: the share of spoilt instances, chosen individually or in patches.

    A detector that misses white holds on grey walls misses a whole route. Patches therefore leave
    no detected neighbours.
    """

    share: float
    patches: bool


ROUNDS = (Spoilt(0.0, False), Spoilt(0.4, False), Spoilt(0.5, True))


@dataclass(frozen=True, eq=False)
class Samples:
    """Pieces with known ground truth.

    Parameters
    ----------
    cues : (n, len(CUES)); hold : (n,) bool; explained : (n,) bool, see `evidence.is_explained`.
    """

    cues: Floats
    hold: NDArray[np.bool_]
    explained: NDArray[np.bool_]

    @classmethod
    def together(cls, parts: Sequence[Samples]) -> Samples:
        """Return the concatenation of several sets of samples."""
        return cls(
            np.concatenate([part.cues for part in parts]),
            np.concatenate([part.hold for part in parts]),
            np.concatenate([part.explained for part in parts]),
        )


def spoil_detections(
    found: Detections,
    records: Sequence[InstanceRecord],
    places: Floats,
    spoilt: Spoilt,
    seed: int,
) -> Detections:
    """Return the detections without the masks of some instances, with lower scores for the others.

    Parameters
    ----------
    records : the instances of the lift; places : (n, 3) their positions, metres.
    """
    rng = np.random.default_rng(seed)
    chosen = rng.random(len(records)) < spoilt.share
    if spoilt.patches:
        chosen[:] = False
        while chosen.mean() < spoilt.share:
            away = np.linalg.norm(places - places[rng.integers(len(places))], axis=1)
            chosen |= away < PATCH
    kept: dict[tuple[str, int], float] = {}
    for record, own in zip(records, chosen.tolist(), strict=True):
        keeps = (KEPT if rng.random() < FEW else 0.0) if own else 1.0
        faded = rng.uniform(*FADED) if spoilt.share > 0 else 1.0
        kept.update((view, faded * (rng.random() < keeps)) for view in record.views)
    masks: dict[str, tuple[Mask, ...]] = {}
    for name, own in found.masks.items():
        scores = [kept.get((name, k), 1.0) for k in range(len(own))]
        masks[name] = tuple(
            replace(mask, score=mask.score * score)
            for mask, score in zip(own, scores, strict=True)
            if score > 0
        )
    return replace(found, masks=masks)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scan of a generated gym, with all data that does not depend on the piece settings.

    Parameters
    ----------
    ground, seen : of its mesh and photos; carried : the truth transferred to its mesh.
    rounds : per round of spoiling, the lift's face labels and the mask evidence of each instance.
    """

    ground: Ground
    seen: list[PhotoView]
    carried: Carried
    rounds: list[tuple[NDArray[np.int32], dict[int, Masks]]]


def prepare_scan(folder: Path, gym: Path, ways: Sequence[Spoilt] = ROUNDS) -> Prepared:
    """Read a scan with mesh and detections, and lift it with and without spoilt masks."""
    scan, truth = ScanFolder(folder), read_truth(gym)
    mesh = read_mesh(scan.mesh).without_guesses()
    views = read_views(scan.sparse)
    turned = align_views(scan_views(scan, truth), truth.views, False).mesh(mesh)
    found = Detections.load(scan.detections)
    table, records = lift_detections(mesh, views, found)
    whole, first = table.face_instance, records.instances
    places = np.array([mesh.centroids[whole == record.id].mean(axis=0) for record in first])
    rounds = []
    for number, way in enumerate(ways):
        kept = spoil_detections(found, first, places, way, number)
        table, records = lift_detections(mesh, views, kept)
        rounds.append((table.face_instance, masks_of(records.instances, kept)))
    return Prepared(
        Ground.of(mesh, 1.0, True, ProposeSettings().seed),
        list(photo_views(mesh, views, PhotoSet(scan.photos), Silent())),
        carry_truth(truth, turned, WITHIN, REACH_M),
        rounds,
    )


def samples_of(prepared: Prepared) -> Samples:
    """Return the samples of a scan: its pieces of surface whose truth is known."""
    parts = []
    for label, known_masks in prepared.rounds:
        pieces = gather_pieces(
            prepared.ground, label, known_masks, ProposeSettings().sure, prepared.seen
        )
        parts.append(_labelled_pieces(pieces, prepared.carried, prepared.ground.mesh))
    return Samples.together(parts)


def lift_detections(
    mesh: Mesh, views: Sequence[View], found: Detections
) -> tuple[InstanceTable, InstanceRecords]:
    """Return the instances of a scan's detections, by the settings of a scan."""
    masked = [view.with_masks(found.masks.get(view.name, ())) for view in views]
    instances = lift(mesh, masked, Settings().lift, Silent())
    return table_of(instances), records_of(instances, masked, found.classes)


def _labelled_pieces(pieces: Pieces, carried: Carried, mesh: Mesh) -> Samples:
    """Return the pieces with the label whether they are holds; ambiguous ones are left out."""
    true = carried.labelled.face_instance
    area = np.where(carried.ignored, 0.0, mesh.areas)
    shape = (int(pieces.label.max(initial=0)) + 1, int(true.max(initial=0)) + 1)
    shared = np.zeros(shape)
    np.add.at(shared, (pieces.label, true), area)
    own, whole = shared.sum(axis=1), shared.sum(axis=0)
    iou = shared / np.maximum(own[:, None] + whole[None] - shared, 1e-12)
    ids = np.array(pieces.ids, dtype=np.int64)
    best = iou[ids, 1:].max(axis=1)
    on_truth = shared[ids, 1:].sum(axis=1) / np.maximum(own[ids], 1e-12)
    seen = own[ids] > 0.5 * np.bincount(pieces.label, mesh.areas, shape[0])[ids]
    used = seen & ((best >= MET) | (on_truth < NONE))
    covered = np.array(
        [is_explained(pieces.relief[n], pieces.masks[n], pieces.tint[n]) for n in pieces.ids]
    )
    return Samples(pieces.cues()[used], best[used] >= MET, covered[used])


def fit_model(samples: Samples, made_by: str = "") -> EvidenceModel:
    """Fit the model to samples."""
    masked = samples.cues[:, CUES.index("masks")] > 0
    return EvidenceModel(
        cues=CUES,
        masked=_fit_weights(samples.cues[masked], samples.hold[masked]),
        unmasked=_fit_weights(samples.cues[~masked], samples.hold[~masked]),
        made_by=made_by,
    )


def _fit_weights(cues: Floats, hold: NDArray[np.bool_]) -> Weights:
    """Fit one logistic regression; constant cues get weight 0."""
    from sklearn.linear_model import LogisticRegression

    middle, spread = cues.mean(axis=0), cues.std(axis=0)
    spread = np.where(spread > 1e-6, spread, 1.0)
    model = LogisticRegression(C=1.0, max_iter=3000)
    model.fit((cues - middle) / spread, hold)
    return Weights(
        tuple(middle.round(5).tolist()),
        tuple(spread.round(5).tolist()),
        tuple(model.coef_[0].round(5).tolist()),
        round(float(model.intercept_[0]), 5),
    )
