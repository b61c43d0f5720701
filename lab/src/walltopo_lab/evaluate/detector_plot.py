"""Precision-recall curves of a detector, as PNG."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from walltopo_lab.evaluate.detector import RECALLS, DetectorMetrics
from walltopo_lab.plotting import Axis, Chart, write_charts

__all__ = ["write_curves"]


def write_curves(metrics: DetectorMetrics, folder: Path) -> list[Path]:
    """Write `curves-boxes.png` and, where masks were compared, `curves-masks.png`."""
    written: list[Path] = []
    for run, rows in (("boxes", metrics.boxes), ("masks", metrics.masks)):
        charts = []
        for at in ("50", "75"):
            chart = Chart(f"{run}, IoU .{at}", Axis("recall", 0, 1), Axis("precision", 0, 1))
            for series, (name, figures) in enumerate(rows.items()):
                curve = figures.precision50 if at == "50" else figures.precision75
                if name != "mean" and not np.isnan(curve).any():
                    label = f"{name} (AP {curve.mean():.2f})"
                    chart.line(RECALLS.tolist(), curve.tolist(), label, series)
            charts.append(chart)
        if rows:
            path = folder / f"curves-{run}.png"
            write_charts(path, charts)
            written.append(path)
    return written
