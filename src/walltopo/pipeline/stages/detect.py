"""Run the stage `detect`: photos to 2D masks of holds and volumes in `detections.json`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Cost, Stage
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.segment.settings import DetectSettings


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    detections: Detections = of(ScanFolder.detections)
    metrics: Metrics = figures()


def check(settings: DetectSettings) -> None:
    """Open a detector other than the shipped one, so that a bad model fails early."""
    if settings.model != DetectSettings().model:
        from walltopo.segment.detect.detector import open_detector

        open_detector(settings)


def run(reads: Reads, settings: DetectSettings, context: Context) -> Writes:
    """Detect 2D masks of holds and volumes in the photos."""
    from walltopo.segment.detect.detector import open_detector
    from walltopo.segment.detect.photos import detect_photos

    photos = sorted(reads.photos.path(photo.name) for photo in reads.photo_list.photos)
    hidden = reads.photos.people_mask
    return Writes(*detect_photos(photos, open_detector(settings), context.progress, hidden=hidden))


MODELS = ("holds.onnx", "holds-int8.onnx")
DETECT = Stage("detect", Reads, Writes, run, check, version=3, models=MODELS, cost=Cost(2, 0.46))
