"""The stage `detect`: photos to 2D masks of holds and volumes: `detections.json`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Stage
from walltopo.scans.artifacts import figures, of
from walltopo.scans.context import Context
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.segment.detect.settings import DetectSettings


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    detections: Detections = of(ScanFolder.detections)
    metrics: Metrics = figures()


def check(settings: DetectSettings) -> None:
    """Open a detector that is not the shipped one, so that a bad model is found at once."""
    if settings.model != DetectSettings().model:
        from walltopo.segment.detect.detector import open_detector

        open_detector(settings)


def run(reads: Reads, settings: DetectSettings, context: Context) -> Writes:
    """Photos to 2D masks of holds and volumes: `detections.json`."""
    from walltopo.segment.detect.detector import open_detector
    from walltopo.segment.detect.photos import detect_photos

    photos = sorted(reads.photos.path(photo.name) for photo in reads.photo_list.photos)
    return Writes(*detect_photos(photos, open_detector(settings), context.progress))


DETECT = Stage("detect", Reads, Writes, run, check, version=2)
