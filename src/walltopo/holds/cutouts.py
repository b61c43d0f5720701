"""Masked crops of each hold, kept small in the scan folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.holds.observations import HoldView
from walltopo.core.files import atomic_path, write_json

__all__ = ["best_views", "write_cutouts"]


def best_views(views: Sequence[HoldView], count: int) -> list[HoldView]:
    """The views with most pixels that are not blurred against the others, best first."""
    if not views:
        return []
    limit = 0.3 * float(np.median([view.sharpness for view in views]))
    ranked = sorted(views, key=lambda v: (v.sharpness < limit, -v.quality, v.photo))
    return ranked[:count]


def write_cutouts(
    folder: Path, views: Mapping[int, Sequence[HoldView]], photos: Sequence[str]
) -> None:
    """Write `<id>_<rank>.webp` (RGB with the hold's mask as alpha) and `index.json`; atomic.

    Parameters
    ----------
    views : hold id to the views to keep, best first.
    photos : names of the photos, by number.
    """
    from PIL import Image

    index: list[dict[str, Any]] = []
    with atomic_path(folder) as temporary:
        temporary.mkdir()
        for hold in sorted(views):
            for rank, view in enumerate(views[hold]):
                name = f"{hold:05d}_{rank}.webp"
                alpha = np.where(view.mask, 255, 0).astype(np.uint8)
                picture = Image.fromarray(np.dstack([view.crop, alpha]))
                picture.save(temporary / name, quality=80, method=2, exact=True)
                index.append(
                    {
                        "id": hold,
                        "file": name,
                        "photo": photos[view.photo],
                        "pixels": view.pixels,
                        "sharpness": round(view.sharpness, 1),
                        "cut": view.cut,
                    }
                )
        write_json(temporary / "index.json", {"version": 1, "cutouts": index})
