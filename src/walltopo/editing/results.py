"""Convert the outcome of a log to the editor's message: rows, and the labels of the surface."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.editing.messages import EditResult, ShownHold
from walltopo.editing.replay import Outcome
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.view_crops import cutout_of
from walltopo.publish.labels import surface_labels
from walltopo.scans.holds import Hold

Labels = NDArray[np.int32]


def shown_labels(labels: Labels, holds: Iterable[int]) -> Labels:
    """Return (F,) the labels of holds, and 0 elsewhere."""
    shown = np.isin(labels, list(holds))
    return np.where(shown, labels, 0).astype(np.int32)


def result_of(snapshot: ScanSnapshot, outcome: Outcome) -> EditResult:
    """Return the editor's message for the outcome of a log."""
    rows = [
        ShownHold(**_fields(row), cutout=cutout_of(outcome.pictures.get(row.id)))
        for row in outcome.holds.holds
    ]
    rows += [ShownHold(**_fields(row)) for row in outcome.holds.left_out]
    labels = shown_labels(outcome.labels, (row.id for row in outcome.holds.holds))
    return EditResult(
        holds=tuple(sorted(rows, key=lambda row: row.id)),
        routes=outcome.routes.routes,
        surface=surface_labels(snapshot.mesh, snapshot.labels, labels),
        hidden=outcome.hidden,
        notes=outcome.notes,
    )


def _fields(row: Hold) -> dict[str, Any]:
    return {name: getattr(row, name) for name in Hold.__struct_fields__}
