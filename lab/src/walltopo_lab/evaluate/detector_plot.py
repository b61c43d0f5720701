"""Precision-recall curves of a detector, as PNG."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from walltopo_lab.evaluate.detector import RECALLS, DetectorMetrics
from walltopo_lab.plots import make_panels, save_figure


def write_curves(metrics: DetectorMetrics, folder: Path) -> list[Path]:
    """Write `curves-boxes.png` and, with masks, `curves-masks.png`; return the paths."""
    written: list[Path] = []
    for run, rows in (("boxes", metrics.boxes), ("masks", metrics.masks)):
        if not rows:
            continue
        figure, axes = make_panels(2)
        for panel, at in zip(axes, ("50", "75"), strict=True):
            panel.set(title=f"{run}, IoU .{at}", xlabel="recall", ylabel="precision")
            panel.set(xlim=(0, 1), ylim=(0, 1.02))
            for name, figures in rows.items():
                curve = figures.precision50 if at == "50" else figures.precision75
                if name != "mean" and not np.isnan(curve).any():
                    panel.plot(RECALLS, curve, label=f"{name} (AP {curve.mean():.2f})")
            panel.legend()
        written.append(folder / f"curves-{run}.png")
        save_figure(figure, written[-1])
    return written
