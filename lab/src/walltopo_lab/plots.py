"""Matplotlib figures with several panels, and the colours of series."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from walltopo.core.files import atomic_path

# Okabe & Ito palette: distinguishable for people with colour blindness.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")


def make_panels(count: int, columns: int = 2) -> tuple[Any, list[Any]]:
    """Return a `matplotlib.figure.Figure` with `count` axes; needs no window or global state."""
    from matplotlib.figure import Figure

    columns = min(columns, count)
    rows = math.ceil(count / columns)
    figure = Figure(figsize=(5.6 * columns, 4.0 * rows), layout="constrained")
    axes = [figure.add_subplot(rows, columns, k + 1) for k in range(count)]
    for one in axes:
        one.set_prop_cycle(color=COLOURS)
        one.grid(color="0.9")
        one.set_axisbelow(True)
    return figure, axes


def save_figure(figure: Any, path: Path) -> None:
    """Write a figure in the format of the path's suffix; atomic."""
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format=path.suffix[1:])
