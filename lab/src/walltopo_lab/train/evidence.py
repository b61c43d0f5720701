"""Fits how masks, relief and colour say together what is a hold (`models/evidence.json`).

The shipped detector finds nearly all holds of generated gyms; so that the fit learns what to do
where it does not, the masks of some holds are taken away, all or most of them, by a seed. Pieces
that meet a true instance at an IoU of .5 are holds, those with less than .1 of their area on any
are none, the others teach nothing. `python -m walltopo_lab.benchmarks.evidence` is the command.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, Mesh, Silent, View
from walltopo.geometry.ply import read_mesh
from walltopo.pipeline.settings import Settings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecord
from walltopo.scans.photos import PhotoSet
from walltopo.segment.lift import lift
from walltopo.segment.lift_files import records_of, table_of
from walltopo.segment.propose.evidence import CUES, EvidenceModel, Masks, Weights, explained
from walltopo.segment.propose.pieces import Ground, Pieces, gather_pieces, masks_of
from walltopo.segment.propose.settings import ProposeSettings
from walltopo.segment.propose.tint import Sight, sights
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import Carried, carry_truth
from walltopo_lab.evaluate.mesh import REACH_M
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth

Floats = NDArray[np.float64]

PATCH = 0.8  # metres: radius of the places where all instances lose masks
FEW, KEPT = 0.5, 0.125  # share of those that keep some masks, and so many; the others lose all
# A detector is less sure of photos unlike those that it learnt from: scores are multiplied.
FADED = (0.5, 1.0)
MET, NONE = 0.5, 0.1
WITHIN = 0.02


@dataclass(frozen=True)
class Spoilt:
    """A way to spoil: the share of the instances that lose masks, one by one or in patches.

    A detector that does not see white on grey misses all of a route, so that what it missed has no
    neighbours that it saw.
    """

    share: float
    patches: bool


ROUNDS = (Spoilt(0.0, False), Spoilt(0.4, False), Spoilt(0.5, True))


@dataclass(frozen=True, eq=False)
class Samples:
    """Pieces with an answer.

    Parameters
    ----------
    cues : (n, len(CUES)); hold : (n,) bool; explained : (n,) bool, see `evidence.explained`.
    """

    cues: Floats
    hold: NDArray[np.bool_]
    explained: NDArray[np.bool_]

    @classmethod
    def together(cls, parts: Sequence[Samples]) -> Samples:
        """All samples of some."""
        return cls(
            np.concatenate([part.cues for part in parts]),
            np.concatenate([part.hold for part in parts]),
            np.concatenate([part.explained for part in parts]),
        )


def spoil(
    found: Detections,
    records: Sequence[InstanceRecord],
    places: Floats,
    spoilt: Spoilt,
    seed: int,
) -> Detections:
    """The detections without the masks of some instances, and less sure of all others.

    Parameters
    ----------
    records : the instances of the lift; places : (n, 3) of them, metres.
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
    """A scan of a generated gym, with all that does not hang on how pieces are made.

    Parameters
    ----------
    ground, seen : of its mesh and photos; carried : the truth on its mesh.
    rounds : per round of spoiling the lift's labels and what the masks say of each instance.
    """

    ground: Ground
    seen: list[Sight]
    carried: Carried
    rounds: list[tuple[NDArray[np.int32], dict[int, Masks]]]


def prepare(folder: Path, gym: Path, ways: Sequence[Spoilt] = ROUNDS) -> Prepared:
    """Read a scan that has a mesh and detections, and lift it with and without spoilt masks."""
    scan, truth = ScanFolder(folder), read_truth(gym)
    mesh = read_mesh(scan.mesh).without_guesses()
    views = read_views(scan.sparse)
    turned = align_views(scan_views(scan, truth), truth.views, False).mesh(mesh)
    found = Detections.load(scan.detections)
    whole, first = _lifted(mesh, views, found)
    places = np.array([mesh.centroids[whole == record.id].mean(axis=0) for record in first])
    rounds = []
    for number, way in enumerate(ways):
        kept = spoil(found, first, places, way, number)
        label, records = _lifted(mesh, views, kept)
        rounds.append((label, masks_of(records, kept)))
    return Prepared(
        Ground.of(mesh, 1.0, True, ProposeSettings().seed),
        list(sights(mesh, views, PhotoSet(scan.photos), Silent())),
        carry_truth(truth, turned, WITHIN, REACH_M),
        rounds,
    )


def samples_of(prepared: Prepared) -> Samples:
    """The pieces of a scan that have an answer."""
    parts = []
    for label, said in prepared.rounds:
        pieces = gather_pieces(prepared.ground, label, said, ProposeSettings().sure, prepared.seen)
        parts.append(_answered(pieces, prepared.carried, prepared.ground.mesh))
    return Samples.together(parts)


def _lifted(
    mesh: Mesh, views: Sequence[View], found: Detections
) -> tuple[NDArray[np.int32], Sequence[InstanceRecord]]:
    masked = [view.with_masks(found.masks.get(view.name, ())) for view in views]
    instances = lift(mesh, masked, Settings().lift, Silent())
    records = records_of(instances, masked, found.classes).instances
    return table_of(instances).face_instance, records


def _answered(pieces: Pieces, carried: Carried, mesh: Mesh) -> Samples:
    """Which pieces are holds; those in between are left out."""
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
    told = np.array(
        [explained(pieces.relief[n], pieces.masks[n], pieces.tint[n]) for n in pieces.ids]
    )
    return Samples(pieces.cues()[used], best[used] >= MET, told[used])


def fit(samples: Samples, made_by: str = "") -> EvidenceModel:
    """The model of some samples."""
    masked = samples.cues[:, CUES.index("masks")] > 0
    return EvidenceModel(
        cues=CUES,
        masked=_weights(samples.cues[masked], samples.hold[masked]),
        unmasked=_weights(samples.cues[~masked], samples.hold[~masked]),
        made_by=made_by,
    )


def _weights(cues: Floats, hold: NDArray[np.bool_]) -> Weights:
    """One regression; cues that never differ weigh nothing."""
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
