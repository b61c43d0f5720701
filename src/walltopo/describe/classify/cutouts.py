"""Masked crops of each hold, kept small in the scan folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from walltopo.core.parallel import ahead
from walltopo.describe.classify.observations import HoldView
from walltopo.scans.pictures import INDEX, Cutout, CutoutIndex, Cutouts


def best_views(views: Sequence[HoldView], count: int) -> list[HoldView]:
    """The views with most pixels that are not blurred against the others, best first."""
    if not views:
        return []
    limit = 0.3 * float(np.median([view.sharpness for view in views]))
    ranked = sorted(views, key=lambda v: (v.sharpness < limit, -v.quality, v.photo))
    return ranked[:count]


def write_cutouts(
    folder: Path, views: Mapping[int, Sequence[HoldView]], photos: Sequence[str]
) -> Cutouts:
    """Write `<id>_<rank>.webp` (RGB with the hold's mask as alpha) and the index.

    Parameters
    ----------
    folder : a new one.
    views : hold id to the views to keep, best first.
    photos : names of the photos, by number.
    """
    folder.mkdir()
    ranked = [(hold, rank, v) for hold in sorted(views) for rank, v in enumerate(views[hold])]

    def written(item: tuple[int, int, HoldView]) -> Cutout:
        hold, rank, view = item
        name = f"{hold:05d}_{rank}.webp"
        _write(folder / name, view)
        photo, sharpness = photos[view.photo], round(view.sharpness, 1)
        return Cutout(hold, name, photo, view.pixels, sharpness, view.cut)

    index = list(ahead(written, ranked))
    CutoutIndex(cutouts=tuple(index)).save(folder / INDEX)
    return Cutouts(folder, tuple(index))


def _write(path: Path, view: HoldView) -> None:
    from PIL import Image

    alpha = np.where(view.mask, 255, 0).astype(np.uint8)
    picture = Image.fromarray(np.dstack([view.crop, alpha]))
    picture.save(path, quality=80, method=2, exact=True)
