"""The scale plate: four ArUco markers on the floor that give metres."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet

PLATE_SIDE = 0.42
MARKER_SIDE = 0.15
MARKER_EDGE = 0.02
PLATE_TEXEL = 0.001
_LIFT = 0.004  # thickness of the plate


def plate_image(number: int) -> NDArray[np.uint8]:
    """Return the (420, 420) grey print of plate `number`, one texel a millimetre, row 0 at the top.

    Ids 4n (top left), 4n+1 (top right), 4n+2 (bottom right), 4n+3 (bottom left).
    """
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    side, marker = round(PLATE_SIDE / PLATE_TEXEL), round(MARKER_SIDE / PLATE_TEXEL)
    edge = round(MARKER_EDGE / PLATE_TEXEL)
    far = side - edge - marker
    plate = np.full((side, side), 235, np.uint8)
    for k, (row, column) in enumerate([(edge, edge), (edge, far), (far, far), (far, edge)]):
        image = cv2.aruco.generateImageMarker(dictionary, 4 * number + k, marker)
        plate[row : row + marker, column : column + marker] = np.where(image > 0, 235, 22)
    return plate


def place_plates(
    wall: list[Facet], numbers: Sequence[int], rng: np.random.Generator
) -> list[Facet]:
    """Return plates with the given numbers, spread on the mats about 1 m before the wall."""
    points = np.concatenate([f.corners for f in wall])
    width = points[:, 0].max() - points[:, 0].min()
    plates = []
    for place, number in enumerate(numbers):
        x = points[:, 0].min() + width * (place + 0.5) / len(numbers)
        x += rng.uniform(-0.1, 0.1) * width / len(numbers)
        near = points[np.abs(points[:, 0] - x) < 1.5]
        foot = points if len(near) == 0 else near
        y = min(foot[foot[:, 2] < 0.01][:, 1].min() if (foot[:, 2] < 0.01).any() else 0.0, 0.0)
        centre = np.array([x, y - rng.uniform(0.7, 1.0), _LIFT])
        angle = rng.uniform(-0.4, 0.4)
        right = np.array([np.cos(angle), np.sin(angle), 0]) * PLATE_SIDE / 2
        up = np.array([-np.sin(angle), np.cos(angle), 0]) * PLATE_SIDE / 2
        corners = centre + np.array([-right - up, right - up, right + up, -right + up])
        plates.append(Facet(corners, "plate", texel=PLATE_TEXEL, style=number))
    return plates


def plate_record(plate: Facet) -> dict[str, Any]:
    """Return the plate's entry in `scene.json`: number and corners in metres."""
    return {"plate": plate.style, "corners_bl_br_tr_tl": plate.corners.tolist()}
