"""A place of the wall in photos, for who decides what is there."""

from __future__ import annotations

import base64
from weakref import WeakKeyDictionary

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.describe.classify.observations import HoldView
from walltopo.editing.messages import Crop
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.view_crops import looks_at
from walltopo.scans.edits import Place

REACH = 0.4  # metres around the place
MOST = 4
LONGEST = 480  # pixels
QUALITY = 82
_CUTOUTS: WeakKeyDictionary[HoldView, str] = WeakKeyDictionary()


def crops_of(scanned: ScanSnapshot, at: Place) -> list[Crop]:
    """The best photos of a place, best first; none where no photo shows it."""
    found = []
    for look in looks_at(scanned, at, REACH * scanned.unit, MOST):
        height, width = look.picture.shape[:2]
        factor = min(1.0, LONGEST / max(height, width))
        size = max(1, round(width * factor)), max(1, round(height * factor))
        small = cv2.resize(look.picture, size, interpolation=cv2.INTER_AREA)
        bgr = np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2BGR), dtype=np.uint8)
        address = _address("jpeg", bgr, cv2.IMWRITE_JPEG_QUALITY)
        found.append(Crop(look.name, address, round(look.x / width, 4), round(look.y / height, 4)))
    return found


def cutout_of(view: HoldView | None) -> str:
    """A hold's picture without what is around it, as an address; empty where there is none."""
    if view is None:
        return ""
    if view not in _CUTOUTS:
        alpha = np.where(view.mask, 255, 0).astype(np.uint8)
        bgra = np.dstack([view.crop[..., ::-1], alpha])
        _CUTOUTS[view] = _address("webp", bgra, cv2.IMWRITE_WEBP_QUALITY)
    return _CUTOUTS[view]


def _address(kind: str, picture: NDArray[np.uint8], quality: int) -> str:
    _, data = cv2.imencode(f".{kind}", picture, [quality, QUALITY])
    return f"data:image/{kind};base64," + base64.b64encode(data.tobytes()).decode("ascii")
