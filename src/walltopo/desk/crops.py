"""A place of the wall in photos, for who decides what is there."""

from __future__ import annotations

import base64

import cv2

from walltopo.edit.board import Scanned
from walltopo.edit.sight import looks_at
from walltopo.export.server.desk import Crop
from walltopo.scans.edits import Place

__all__ = ["crops_of"]

REACH = 0.4  # metres around the place
MOST = 4
LONGEST = 480  # pixels
QUALITY = 82


def crops_of(scanned: Scanned, at: Place) -> list[Crop]:
    """The best photos of a place, best first; none where no photo shows it."""
    found = []
    for look in looks_at(scanned, at, REACH * scanned.unit, MOST):
        height, width = look.picture.shape[:2]
        factor = min(1.0, LONGEST / max(height, width))
        size = max(1, round(width * factor)), max(1, round(height * factor))
        small = cv2.resize(look.picture, size, interpolation=cv2.INTER_AREA)
        bgr = cv2.cvtColor(small, cv2.COLOR_RGB2BGR)
        _, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        address = "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode("ascii")
        found.append(Crop(look.name, address, round(look.x / width, 4), round(look.y / height, 4)))
    return found
