"""Statistics of a set: counts, sizes, and a chart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from walltopo_lab.datasets.model import Dataset
from walltopo_lab.datasets.split import group_of_photo
from walltopo_lab.plots import make_panels, save_figure


def dataset_stats(dataset: Dataset) -> dict[str, Any]:
    """Return counts and sizes, JSON-serialisable.

    Returns
    -------
    photos, objects, groups (see `group_of_photo`), empty_photos, objects_per_photo (min, median,
    max), and per class: objects, photos, with_shape, size_px (5, 50, 95 %; the root of the box's
    area).
    """
    counts = np.array([len(photo.annotations) for photo in dataset.photos])
    classes: dict[str, Any] = {}
    for label, name in sorted(dataset.classes.items()):
        rows = [(p, a) for p in dataset.photos for a in p.annotations if a.label == label]
        sizes = np.sqrt([abs(a.box[2] * a.box[3]) for _, a in rows])
        spread = np.percentile(sizes, [5, 50, 95]) if rows else np.zeros(3)
        classes[name] = {
            "objects": len(rows),
            "photos": len({photo.name for photo, _ in rows}),
            "with_shape": sum(a.has_shape for _, a in rows),
            "size_px": [round(float(v), 1) for v in spread],
        }
    usual = [int(counts.min()), float(np.median(counts)), int(counts.max())] if len(counts) else []
    return {
        "photos": len(dataset.photos),
        "objects": int(counts.sum()),
        "groups": len({group_of_photo(photo) for photo in dataset.photos}),
        "empty_photos": int((counts == 0).sum()),
        "objects_per_photo": usual,
        "classes": classes,
    }


def write_stats_plot(path: Path, dataset: Dataset) -> None:
    """Write a PNG with the histograms of objects per photo and of object sizes."""
    counts = [len(photo.annotations) for photo in dataset.photos]
    sizes = [
        float(np.sqrt(abs(a.box[2] * a.box[3]))) for p in dataset.photos for a in p.annotations
    ]
    figure, (per_photo, sizes_panel) = make_panels(2)
    _histogram(per_photo, "objects per photo", "objects", counts)
    _histogram(sizes_panel, "size of objects (root of box area)", "px", sizes)
    save_figure(figure, path)


def _histogram(panel: Any, title: str, unit: str, values: Sequence[float]) -> None:
    top = max(float(np.percentile(values, 99)), 1.0) if values else 1.0
    panel.hist(np.minimum(values, top), bins=24, range=(0, top))
    panel.set(title=title, xlabel=unit)
