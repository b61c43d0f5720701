"""What is in a set: counts, sizes, and a chart of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from walltopo_lab.datasets.model import Dataset
from walltopo_lab.datasets.split import group_of_photo
from walltopo_lab.plotting import Axis, Chart, write_charts

__all__ = ["dataset_stats", "write_stats_plot"]


def dataset_stats(dataset: Dataset) -> dict[str, Any]:
    """Counts and sizes, JSON-able.

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
    """A PNG with the histograms of objects per photo and of object sizes."""
    counts = [len(photo.annotations) for photo in dataset.photos]
    sizes = [
        float(np.sqrt(abs(a.box[2] * a.box[3]))) for p in dataset.photos for a in p.annotations
    ]
    charts = [
        _histogram("objects per photo", "objects", counts or [0.0], "photos"),
        _histogram("size of objects (root of box area)", "px", sizes or [0.0], "objects"),
    ]
    write_charts(path, charts)


def _histogram(title: str, unit: str, values: list[Any], what: str) -> Chart:
    top = max(float(np.percentile(values, 99)), 1.0)
    heights, edges = np.histogram(np.minimum(values, top), bins=24, range=(0, top))
    chart = Chart(title, Axis(unit, 0, top), Axis(what, 0, 1.1 * float(heights.max() or 1)))
    chart.bars(edges.tolist(), heights.tolist())
    return chart
