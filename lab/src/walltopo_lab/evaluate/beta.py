"""Figures of rendered clips, read against a scan of their gym."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.geometry.similarity import Similarity
from walltopo.scans.folder import ScanFolder
from walltopo_climb.beta.clip import ClipReading, read_clip
from walltopo_climb.beta.scanned_wall import ScannedWall
from walltopo_lab.evaluate.align import align_views, same_holds
from walltopo_lab.evaluate.contacts import ContactCounts, count_contacts, order_distance
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.synth.climbs import read_true_wall
from walltopo_lab.synth.filmed import FilmedClip

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class KnownWall:
    """A scan whose holds and routes are known in the gym that it shows.

    Parameters
    ----------
    holds : id in the gym by id in the scan, 0 for those that the gym lacks.
    routes : the same of routes, None for those that the gym lacks.
    places : (N, 3) m, of the scan's holds in the gym's frame.
    """

    scanned: ScannedWall
    holds: Mapping[int, int]
    routes: Mapping[int, int | None]
    places: Floats

    @classmethod
    def match(cls, scan: ScanFolder, gym: Path) -> KnownWall:
        """Match a scan of a gym's photos with the gym, by place.

        Raises
        ------
        InputError : the folders are no scan and no gym, or the scan has other photos.
        """
        scanned, true = ScannedWall.load(scan), read_true_wall(gym)
        exact = read_truth(gym)
        frame: Similarity = align_views(scan_views(scan, exact), exact.views, similarity=True)
        places = frame.apply(np.array([hold.position for hold in scanned.holds]))
        holds = same_holds(scanned.holds, places, {hold.id: hold.position for hold in true.holds})
        routes: dict[int, int | None] = {}
        for route in scanned.routes:
            shared = {
                one.id: sum(holds[hold] in one.holds for hold in route.holds) for one in true.routes
            }
            best = max(shared, key=lambda key: shared[key])
            routes[route.id] = best if shared[best] else None
        return cls(scanned, holds, routes, places)


@dataclass
class ClipFigures:
    """The figures of one clip.

    Parameters
    ----------
    clip : file name. refused : the message, if the clip could not be read.
    camera_px : median distance of holds in the frames from their true places.
    order : edit distance of the hands' moves, as a share of the longer sequence.
    seconds, cpu_seconds : spent on reading; length_s : of the clip.
    """

    clip: str
    truth: FilmedClip
    refused: str = ""
    camera_px: float = 0.0
    hands: ContactCounts = field(default_factory=ContactCounts)
    feet: ContactCounts = field(default_factory=ContactCounts)
    order: float = 0.0
    is_named: bool = False
    is_topped: bool = False
    has_fall: bool = False
    seconds: float = 0.0
    cpu_seconds: float = 0.0


def evaluate_clip(video: Path, truth: FilmedClip, wall: KnownWall) -> ClipFigures:
    """Read a clip as a user's, without its route, and compare."""
    figures = ClipFigures(video.name, truth)
    begun, spent = time.perf_counter(), time.process_time()
    try:
        reading = read_clip(video, wall.scanned)
    except InputError as error:
        figures.refused = error.message
        return figures
    figures.seconds, figures.cpu_seconds = time.perf_counter() - begun, time.process_time() - spent
    attempt = reading.attempt
    found = [replace(one, hold=wall.holds.get(one.hold, 0)) for one in attempt.contacts]
    count_contacts(found, truth.contacts, figures.hands, figures.feet)
    figures.order = order_distance([one for one in found if one.hold], truth.contacts)
    named = None if attempt.route is None else wall.routes[attempt.route]
    figures.is_named = named == truth.route
    figures.is_topped, figures.has_fall = attempt.top is not None, attempt.fall is not None
    figures.camera_px = _camera_error(truth, reading, wall)
    return figures


def figures_row(one: ClipFigures) -> str:
    """Return a line on one clip."""
    truth = one.truth
    kind = "in a hand" if truth.is_handheld else "standing"
    if one.refused:
        return f"{one.clip} ({kind}): {one.refused}"
    return (
        f"{one.clip} ({kind}): camera {one.camera_px:.1f} px, hands F1 {one.hands.f1:.2f}, "
        f"feet {one.feet.f1:.2f}, route {'right' if one.is_named else 'wrong'}, "
        f"top {'found' if one.is_topped else '-'} ({'true' if truth.is_topped else '-'}), "
        f"{truth.length:.0f} s read in {one.seconds:.0f} s"
    )


def _camera_error(truth: FilmedClip, reading: ClipReading, wall: KnownWall) -> float:
    seen = np.array([hold.position for hold in wall.scanned.holds]) / wall.scanned.unit
    errors: list[float] = []
    frames = min(len(truth.cam_from_world), len(reading.frames.times))
    for frame in range(frames):
        pose = np.array(truth.cam_from_world[frame])
        true = truth.camera.project(wall.places @ pose[:, :3].T + pose[:, 3])
        inside = ((true > 0) & (true < [truth.width, truth.height])).all(axis=1)
        found, _ = reading.frames.project(frame, seen)
        errors.extend(np.linalg.norm(true - found, axis=1)[inside].tolist())
    return float(np.median(errors)) if errors else float("inf")


@dataclass(frozen=True)
class BetaFigures:
    """The figures of all clips."""

    clips: tuple[ClipFigures, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the sums, JSON-able."""
        read = [one for one in self.clips if not one.refused]
        topped = [one for one in read if one.truth.is_topped]
        others = [one for one in read if not one.truth.is_topped]
        length = sum(one.truth.length for one in read)
        return {
            "clips": len(self.clips),
            "read": len(read),
            "refused": {one.clip: one.refused for one in self.clips if one.refused},
            "camera_median_px": float(np.median([one.camera_px for one in read])) if read else None,
            "hands": _scores([one.hands for one in read]),
            "feet": _scores([one.feet for one in read]),
            "order_distance": float(np.mean([one.order for one in read])) if read else None,
            "routes_named": sum(one.is_named for one in read),
            "tops_true": len(topped),
            "tops_found": sum(one.is_topped for one in topped),
            "tops_wrong": sum(one.is_topped for one in others),
            "falls_true": len(others),
            "falls_found": sum(one.has_fall for one in others),
            "seconds_per_second": sum(one.seconds for one in read) / length if read else None,
            "cpu_seconds_per_second": (
                sum(one.cpu_seconds for one in read) / length if read else None
            ),
        }


def _scores(parts: list[ContactCounts]) -> dict[str, float]:
    whole = ContactCounts(
        sum(one.right for one in parts),
        sum(one.found for one in parts),
        sum(one.true for one in parts),
    )
    return {
        "f1": whole.f1, "precision": whole.precision, "recall": whole.recall, "true": whole.true
    }  # fmt: skip
