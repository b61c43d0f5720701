"""What ties photos to a model: much of what they see, or one thing that is in two places."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["hang_together"]

Floats = NDArray[np.float64]

# Of the spread of all that the new photos see, along the second widest direction. Two rooms with
# the same printed measure on the same floor share .22; parts of one wall shared half or more.
_LEAST_SPREAD = 0.35
_LEAST_TIES = 15


def hang_together(model: Any, known: Collection[str]) -> bool:
    """Whether photos are tied to the known ones by more than one thing that both show.

    Rooms that show one printed measure, a poster or the same hold are matched by it, and fit.

    Parameters
    ----------
    model : `pycolmap.Reconstruction` of all.
    known : names of the photos that belong together for certain.
    """
    new = {
        image.image_id
        for image in model.images.values()
        if image.has_pose and str(image.name) not in known
    }
    if not new or len(new) == model.num_reg_images():
        return True
    ties, seen = [], []
    for point in model.points3D.values():
        mine = {element.image_id in new for element in point.track.elements}
        if True in mine:
            seen.append(point.xyz)
            if False in mine:
                ties.append(point.xyz)
    if len(ties) < _LEAST_TIES:
        return False
    return _spread(np.array(ties)) >= _LEAST_SPREAD * _spread(np.array(seen))


def _spread(points: Floats) -> float:
    """Standard deviation along the second widest direction of (n, 3) points."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1]
    return float(spread) / float(np.sqrt(len(points)))
