"""Several looks at one photo, mirrored or at another size, fused into one answer.

Two looks of one network err differently: what both see is surer than what one sees. Fusing the
detections keeps each look's own resolution, which fusing the network's maps would not; on
held-out photos it gained more, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask
from walltopo.segment.detect.found import Found, box_iou

_SAME = 0.5  # IoU of boxes above which two looks mean one object


def mirrored(found: Found) -> Found:
    """The same detections in the photo mirrored left to right."""
    boxes = found.boxes[:, [2, 1, 0, 3]].copy()
    boxes[:, [0, 2]] = found.width - boxes[:, [0, 2]]
    masks = tuple(
        replace(m, bitmap=m.bitmap[:, ::-1], x=m.width - m.x - m.bitmap.shape[1])
        for m in found.masks
    )
    return replace(found, boxes=boxes, masks=masks)


def _groups(looks: Sequence[Found], boxes: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """Positions in `boxes` (all looks', one after the other) of each object, surest first."""
    scores = np.concatenate([look.scores for look in looks])
    labels = np.concatenate([look.labels for look in looks])
    source = np.repeat(np.arange(len(looks)), [len(look) for look in looks])
    overlap = box_iou(boxes, boxes)
    free = np.ones(len(boxes), np.bool_)
    groups = []
    for first in np.argsort(-scores, kind="stable"):
        if not free[first]:
            continue
        free[first] = False
        group = [int(first)]
        for other in range(len(looks)):
            if other == source[first]:
                continue
            same = free & (source == other) & (labels == labels[first])
            near = np.flatnonzero(same & (overlap[first] > _SAME))
            if len(near):
                group.append(int(near[overlap[first, near].argmax()]))
                free[group[-1]] = False
        groups.append(np.array(group))
    return groups


def fuse(looks: Sequence[Found]) -> Found:
    """One `Found` from several of the same photo, best first.

    Weighted boxes fusion (Solovyev, Wang, Gabruseva, Image and Vision Computing 2021): an
    object's box is the mean of what the looks say, by their scores; its score is the mean over
    all looks, 0 where one does not see it; its mask is that of the surest look.
    """
    if len(looks) == 1:
        return looks[0]
    boxes = np.concatenate([look.boxes for look in looks])
    scores = np.concatenate([look.scores for look in looks])
    labels = np.concatenate([look.labels for look in looks])
    masks = [mask for look in looks for mask in look.masks]
    groups = _groups(looks, boxes)
    fused = np.array([scores[group].sum() / len(looks) for group in groups])
    order = np.argsort(-fused, kind="stable")
    middle = [np.average(boxes[groups[k]], axis=0, weights=scores[groups[k]]) for k in order]
    kept: list[Mask] = []
    if masks:
        kept = [replace(masks[groups[k][0]], score=float(fused[k])) for k in order]
    return Found(
        looks[0].width,
        looks[0].height,
        np.array(middle).reshape(-1, 4),
        fused[order],
        np.array([labels[groups[k][0]] for k in order], dtype=np.int64),
        tuple(kept),
    )
