"""A gym's own network: the shipped one, trained further on corrected scans of that gym.

The holds of a scan after its corrections are drawn back into its photos. The photos of one end of
the wall are held out, and the holds that they show are ignored in the training. Both networks
detect there; the gym's own one is worth using only if it is better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np

from walltopo.core import InputError, Progress
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.colmap_model import read_views
from walltopo.scans.document import Document
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceTable, Relabelled
from walltopo.segment.detect.detector import open_detector, shipped_model
from walltopo.segment.settings import DetectSettings
from walltopo_lab.datasets.model import Dataset, Photo
from walltopo_lab.datasets.project import project_labels
from walltopo_lab.datasets.read import write_dataset
from walltopo_lab.evaluate.detector import evaluate_detections
from walltopo_lab.evaluate.looks import LOW_SCORE, as_dataset, detect_photos
from walltopo_lab.train.detector import Job, train_detector
from walltopo_lab.train.params import AugmentSettings, TrainSettings
from walltopo_lab.train.sets import IGNORED_CATEGORY

CLASSES = {1: "hold", 2: "volume"}
_HIDDEN = 3  # label of objects that are held out
_LABELS = {**CLASSES, _HIDDEN: IGNORED_CATEGORY}
HELD_OUT = 0.25  # share of each scan's photos on which the two networks are compared
MAX_TRAIN, MAX_TEST = 40, 16  # photos, evenly drawn: what a processor does in minutes
MIN_PHOTOS = 2  # to train on, and to compare on
MIN_GAIN = 0.01  # of AP50: less may be chance


class Figures(msgspec.Struct, frozen=True):
    """AP50 of a network's masks.

    Parameters
    ----------
    masks : holds and volumes as one class; mean : the mean of the two classes.
    """

    masks: float
    mean: float


class OwnNetwork(Document, frozen=True, kw_only=True):
    """`own.json`: what a gym's own network was trained on, and how good it is.

    Parameters
    ----------
    photos, objects : trained on; held_out : photos of the comparison.
    before, after : figures of the shipped network and of the gym's own, on the photos held out.
    better : whether the gym's own network is worth using.
    """

    photos: int
    objects: int
    held_out: int
    before: Figures
    after: Figures
    better: bool


def is_better(before: Figures, after: Figures) -> bool:
    """Return whether a gain is more than chance, and no class pays for it."""
    return after.masks - before.masks >= MIN_GAIN and after.mean >= before.mean


@dataclass(frozen=True, eq=False)
class Parts:
    """The photos to train on, and those held out."""

    train: Dataset
    held_out: Dataset


def corrected_labels(scan: ScanFolder, progress: Progress) -> Dataset:
    """Return the photos of a scan, in order along the wall, with its corrected holds as masks.

    Holds that the scan left out or a setter removed are background.

    Raises
    ------
    InputError : a file of the scan is missing, or from another run.
    """
    mesh, views = read_mesh(scan.mesh), read_views(scan.sparse)
    table = InstanceTable.load(scan.instances)
    table.check_fits(mesh)
    faces = table.face_instance
    if scan.relabelled.is_file():
        faces = Relabelled.load(scan.relabelled).on(faces)
    number = {name: label for label, name in CLASSES.items()}
    labels = {hold.id: number[hold.kind] for hold in Holds.load(scan.holds).holds}
    centres = np.array([view.centre for view in views])
    along = np.linalg.svd(centres - centres.mean(axis=0), full_matrices=False)[2][0]
    ordered = [views[k] for k in np.argsort(centres @ along, kind="stable")]
    found = project_labels(mesh, faces, labels, CLASSES, ordered, scan.photos, progress=progress)
    usable = tuple(p for p in found.photos if p.path is not None and p.annotations)
    return Dataset(tuple(replace(p, gym=scan.root.name) for p in usable), CLASSES)


def split_photos(dataset: Dataset) -> tuple[list[Photo], list[Photo]]:
    """Return the photos of one scan to train on, and those held out: one end of the wall.

    Holds that the latter show are ignored in the former.
    """
    photos = dataset.photos
    count = max(MIN_PHOTOS, round(HELD_OUT * len(photos)))
    held_out = list(photos[len(photos) - count :])
    known = {a.extra["instance"] for photo in held_out for a in photo.annotations}
    hidden = [_hide_objects(photo, known) for photo in photos[: len(photos) - count]]
    return [photo for photo in hidden if _count_trained(photo)], held_out


def _hide_objects(photo: Photo, known: set[int]) -> Photo:
    return photo.with_annotations(
        tuple(
            replace(a, label=_HIDDEN) if a.extra["instance"] in known else a
            for a in photo.annotations
        )
    )


def _count_trained(photo: Photo) -> int:
    """Return the number of objects that are trained on."""
    return sum(a.label in CLASSES for a in photo.annotations)


def read_parts(scans: Sequence[ScanFolder], progress: Progress) -> Parts:
    """Return the photos of several scans of one gym.

    Raises
    ------
    InputError : too few photos, or a scan lacks a file.
    """
    train: list[Photo] = []
    held_out: list[Photo] = []
    for k, scan in enumerate(scans):
        own, aside = split_photos(corrected_labels(scan, progress))
        train += [replace(p, name=f"{k}/{p.name}") for p in own]
        held_out += [replace(p, name=f"{k}/{p.name}") for p in aside]
    if len(train) < MIN_PHOTOS or len(held_out) < MIN_PHOTOS:
        raise InputError(
            f"{', '.join(str(scan.root) for scan in scans)}: {len(train)} photos to train on and "
            f"{len(held_out)} to compare on, at least {MIN_PHOTOS} of each are needed",
            "A photo whose holds are all held out counts for neither: more of the wall helps.",
        )
    return Parts(
        Dataset(_spread_photos(train, MAX_TRAIN), _LABELS),
        Dataset(_spread_photos(held_out, MAX_TEST), CLASSES),
    )


def _spread_photos(photos: Sequence[Photo], count: int) -> tuple[Photo, ...]:
    kept = np.linspace(0, len(photos) - 1, min(count, len(photos))).round().astype(int)
    return tuple(photos[k] for k in kept)


def fine_tune(train: Dataset, out: Path, minutes: float, progress: Progress) -> Path:
    """Train the shipped network further on a few photos and return the model.

    The encoder stays as it is, so that a step costs less and little can be forgotten. A stopped run
    resumes.
    """
    model = out / "holds.onnx"
    if not model.is_file():
        write_dataset(out / "photos", train, "coco-rle")
        settings = TrainSettings(
            minutes=minutes,
            rate=1e-4,
            batch=4,
            encoder_rate=0.0,
            held_out=0.0,
            audit=0.0,
            check_every=1e3,
            check_photos=2,
        )
        labels = (out / "photos" / "annotations.json",)
        job = Job(labels, out, pretrained=shipped_model())
        train_detector(job, settings, AugmentSettings(), progress)
    return model


def compare_network(model: Path, test: Dataset) -> Figures:
    """Return the figures of a network on labelled photos, at all scores from `LOW_SCORE`."""
    detector = open_detector(DetectSettings(model=str(model), score=LOW_SCORE))
    seen = detect_photos(detector, [p.path for p in test.photos if p.path]).found
    rows = evaluate_detections(as_dataset(test, seen, CLASSES, masks=True), test).masks
    return Figures(rows["all"].ap50, rows["mean"].ap50)


def train_own(
    scans: Sequence[ScanFolder], out: Path, minutes: float, progress: Progress
) -> OwnNetwork:
    """Train and compare a gym's own network; write `holds.onnx` and `own.json` into `out`."""
    parts = read_parts(scans, progress)
    model = fine_tune(parts.train, out, minutes, progress)
    progress.step("compare on the photos held out")
    before, after = (compare_network(file, parts.held_out) for file in (shipped_model(), model))
    result = OwnNetwork(
        photos=len(parts.train.photos),
        objects=sum(_count_trained(photo) for photo in parts.train.photos),
        held_out=len(parts.held_out.photos),
        before=before,
        after=after,
        better=is_better(before, after),
    )
    result.save(out / "own.json")
    return result
