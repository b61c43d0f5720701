"""Export of the averaged weights, and their comparison with the shipped file.

Both files process all validation photos as a scan does, twice each, and the same evaluator
measures their detections. The better file is the one with the higher mean over classes.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from walltopo.core import Progress
from walltopo.core.files import atomic_path
from walltopo.segment.detect.onnx_detector import OnnxDetector
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.settings import DetectSettings
from walltopo_lab.train.cache import open_cache
from walltopo_lab.train.calibrate import LOW_SCORE, calibrate, look_at
from walltopo_lab.train.choose import figures_of
from walltopo_lab.train.export import export_onnx
from walltopo_lab.train.loop import Run
from walltopo_lab.train.shipped_sets import Part

Figures = dict[str, float]
COLUMNS = {
    "score": "boxes, mean",
    "ap50_hold": "hold",
    "ap50_volume": "volume",
    "ap50": "as one",
    "mask50": "masks, mean",
    "mask50_hold": "hold",
    "mask50_volume": "volume",
}


@dataclass(frozen=True)
class Comparison:
    """AP50 of the shipped and of the exported file.

    Parameters
    ----------
    photos : number of photos by part.
    shipped, exported : metrics by part; the part `all` has all photos.
    settings : calibrated thresholds and offset of the exported file.
    """

    photos: Mapping[str, int]
    shipped: Mapping[str, Figures]
    exported: Mapping[str, Figures]
    settings: Figures

    @property
    def gain(self) -> float:
        """Return by how much the exported file's mean over the classes is higher."""
        return self.exported["all"]["score"] - self.shipped["all"]["score"]

    @property
    def is_better(self) -> bool:
        return self.gain > 0


def _by_part(found: Sequence[PhotoDetections], parts: Sequence[Part]) -> dict[str, Figures]:
    """Return the metrics of each part, and of all; `found`: detections by photo, in part order."""
    figures, start = {}, 0
    for part in [*parts, _all(parts)]:
        if part.name == "all":
            start = 0
        samples = [open_cache(folder, name) for folder, name in part.photos]
        mine = found[start : start + len(samples)]
        figures[part.name] = figures_of(mine, samples, part.exact)
        start += len(samples)
    return figures


def _all(parts: Sequence[Part]) -> Part:
    photos = tuple(photo for part in parts for photo in part.photos)
    return Part("all", photos, tuple(exact for part in parts for exact in part.exact))


def compare(
    run: Run, parts: Sequence[Part], shipped: Path, out: Path, progress: Progress
) -> Comparison:
    """Export a run's averaged weights to `out`, calibrate them, compare them with the shipped ones.

    The thresholds are chosen on the same photos; AP, which has no threshold, decides.
    """
    facts: dict[str, Any] = {
        "version": f"step {run.step}",
        "size": run.average.size.as_dict(),
        "steps": run.step,
        "core_hours": round(run.cpu_seconds / 3600, 2),
    }
    run.average.eval()
    export_onnx(run.average, out, facts)
    return compare_files(out, parts, shipped, progress)


def compare_files(
    exported: Path, parts: Sequence[Part], shipped: Path, progress: Progress
) -> Comparison:
    """Calibrate an exported network on the validation photos and compare it with the shipped one.

    Parameters
    ----------
    exported : its thresholds and offset are written into its metadata.
    """
    photos = _all(parts).photos
    settings, found = calibrate(exported, photos, progress)
    new = _by_part(found, parts)
    detector = OnnxDetector(shipped, replace(DetectSettings(), score=LOW_SCORE))
    progress.step("shipped network", len(photos))
    found = []
    for folder, name in photos:
        found.append(look_at(detector, open_cache(folder, name)))
        progress.advance()
    counts = {part.name: len(part.photos) for part in [*parts, _all(parts)]}
    return Comparison(counts, _by_part(found, parts), new, settings)


def _cell(before: float | None, after: float | None) -> str:
    if before is None or after is None or not math.isfinite(before + after):
        return ""
    return f"{before:.3f} -> {after:.3f}"


def comparison_table(comparison: Comparison) -> str:
    """Return the comparison as a Markdown table: shipped -> exported."""
    lines = [
        f"| photos | number | {' | '.join(COLUMNS.values())} |",
        f"|---|---|{'---|' * len(COLUMNS)}",
    ]
    for part, count in comparison.photos.items():
        before, after = comparison.shipped[part], comparison.exported[part]
        cells = [_cell(before.get(key), after.get(key)) for key in COLUMNS]
        lines.append(f"| {part} | {count} | {' | '.join(cells)} |")
    return "\n".join(lines)


def replace_shipped(
    comparison: Comparison, exported: Path, shipped: Path, max_loss: float = 0.0
) -> bool:
    """Copy the exported file over a shipped one if it loses less than `max_loss` of AP50.

    Returns
    -------
    Whether it was copied.
    """
    replaces = comparison.gain > -max_loss
    if replaces:
        with atomic_path(shipped) as temporary:
            shutil.copyfile(exported, temporary)
    return replaces
