"""Stickers on the wall: markers with a code of their own, by which photos are tied."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.images.markers import STICKER_MARGIN, STICKER_SIDE, STICKERS
from walltopo_lab.synth.bodies import Facet, GymInstance

STICKER_PAPER = STICKER_SIDE + 2 * STICKER_MARGIN
_TEXEL = 0.0005
_LIFT = 0.001  # m; thickness
_TRIES = 200
_AWAY = 0.08  # m between a sticker and a hold's edge


def sticker_image(code: int) -> NDArray[np.uint8]:
    """Return the (190, 190) grey print of a sticker, two texels a millimetre, row 0 at the top."""
    import cv2

    table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, STICKERS))
    paper, side = round(STICKER_PAPER / _TEXEL), round(STICKER_SIDE / _TEXEL)
    edge = (paper - side) // 2
    image = np.full((paper, paper), 235, np.uint8)
    marker = cv2.aruco.generateImageMarker(table, code, side)
    image[edge : edge + side, edge : edge + side] = np.where(marker > 0, 235, 22)
    return image


def place_stickers(
    wall: Sequence[Facet],
    holds: Sequence[GymInstance],
    codes: Sequence[int],
    rng: np.random.Generator,
) -> list[Facet]:
    """Return stickers with the given codes on bare places of the wall, upright within a few
    degrees; fewer where no bare place is found.
    """
    areas = np.array([_area(facet) for facet in wall])
    stickers: list[Facet] = []
    for code in codes:
        for _ in range(_TRIES):
            facet = wall[int(rng.choice(len(wall), p=areas / areas.sum()))]
            sticker = _sticker(facet, code, rng)
            if _is_bare(sticker, facet, [*_keep_out_circles(holds), *_round_stickers(stickers)]):
                stickers.append(sticker)
                break
    return stickers


def _area(facet: Facet) -> float:
    uv = facet.chart(facet.corners)
    x, y = uv.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def _sticker(facet: Facet, code: int, rng: np.random.Generator) -> Facet:
    u, v, n = facet.frame
    uv = facet.chart(facet.corners)
    x, y = rng.uniform(uv.min(axis=0), uv.max(axis=0))
    turn = rng.normal(0, 0.1)
    right = (np.cos(turn) * u + np.sin(turn) * v) * STICKER_PAPER / 2
    up = (np.cos(turn) * v - np.sin(turn) * u) * STICKER_PAPER / 2
    centre = facet.corners[0] + x * u + y * v + _LIFT * n
    corners = centre + np.array([-right - up, right - up, right + up, -right + up])
    return Facet(corners, "sticker", texel=_TEXEL, style=code)


def _keep_out_circles(holds: Sequence[GymInstance]) -> list[tuple[NDArray[np.float64], float]]:
    return [(hold.position, hold.body.radius + _AWAY) for hold in holds if hold.body is not None]


def _round_stickers(stickers: Sequence[Facet]) -> list[tuple[NDArray[np.float64], float]]:
    """Keep stickers half a metre apart, as someone who spreads them would."""
    return [(sticker.corners.mean(axis=0), 0.5) for sticker in stickers]


def _is_bare(
    sticker: Facet, facet: Facet, taken: Sequence[tuple[NDArray[np.float64], float]]
) -> bool:
    centre = sticker.corners.mean(axis=0)
    return all(facet.inside(corner) > 0.01 for corner in sticker.corners) and all(
        np.linalg.norm(centre - place) > reach for place, reach in taken
    )
