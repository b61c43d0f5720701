"""Marks of climbers and setters on the wall: chalk and rubber around holds, tags, T-nuts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet, GymInstance
from walltopo_lab.synth.brush import Canvas, draw_dots, noise_image
from walltopo_lab.synth.tnuts import facet_tnuts

Floats = NDArray[np.float64]

TAG_SIZE = (0.075, 0.045)  # width and height of a start tag, metres


def tnut_holes(canvas: Canvas, facet: Facet, rng: np.random.Generator) -> None:
    uv = facet_tnuts(facet)
    if len(uv) == 0:
        return
    uv = uv + rng.normal(0, 0.0015, uv.shape)
    draw_dots(canvas, uv, 0.0085, 0.30)
    draw_dots(canvas, uv, 0.0055, 0.05)


def chalk_halo(
    canvas: Canvas,
    facet: Facet,
    holds: Sequence[GymInstance],
    amount: float,
    rng: np.random.Generator,
) -> None:
    """Paint chalk and rubber around the holds: hands brush above them, feet scrape below."""
    import cv2

    h, w = canvas.image.shape[:2]
    chalk = np.zeros((h, w), np.float32)
    for hold in holds:
        assert hold.body is not None
        x, y = canvas.pixels(facet.chart(hold.position))
        reach = hold.body.radius / canvas.texel
        if not (-reach < x < w + reach and -reach < y < h + reach):
            continue
        for _ in range(int(rng.integers(1, 5))):
            spot = (int(x + rng.normal(0, reach)), int(y + rng.normal(0.4, 0.8) * reach))
            axes = (
                max(1, int(reach * rng.uniform(0.15, 0.6))),
                max(1, int(reach * rng.uniform(0.1, 0.3))),
            )
            strength = float(rng.uniform(0.1, 0.6))
            cv2.ellipse(chalk, spot, axes, float(rng.uniform(0, 180)), 0, 360, strength, -1)
    soft = max(0.02 / canvas.texel, 0.8)
    chalk = np.asarray(cv2.GaussianBlur(chalk, (0, 0), soft), np.float32)
    chalk *= amount * np.clip(0.8 + 0.5 * noise_image((h, w), (3, 3), rng), 0, 1.5)
    weight = np.clip(chalk, 0, 0.7)[..., None]
    canvas.image[...] = canvas.image * (1 - weight) + 0.93 * weight


def _fill_patch(
    canvas: Canvas,
    sheet: NDArray[np.float64],
    box: tuple[float, float, float, float],
    colour: tuple[float, ...],
) -> None:
    """Fill x0, x1, y0, y1 of a sheet given by its half axes and centre (3, 2), in pixels."""
    import cv2

    x0, x1, y0, y1 = box
    corners = np.array([(x0, y0, 1), (x1, y0, 1), (x1, y1, 1), (x0, y1, 1)]) @ sheet
    fixed = np.round((corners - 0.5) * 16).astype(np.int32)
    cv2.fillConvexPoly(canvas.image, fixed, colour, cv2.LINE_AA, 4)


def _share_on_facet(facet: Facet, middle: Floats, right: Floats, up: Floats) -> float:
    """Return the share of a sheet's area that lies within a facet."""
    steps = np.linspace(-0.95, 0.95, 9)
    points = (middle + x * right + y * up for x in steps for y in steps)
    return float(np.mean([facet.inside(point) > 0 for point in points]))


@dataclass(frozen=True, eq=False)
class Tag:
    """A start tag as drawn.

    Parameters
    ----------
    hold, route : the start hold beside the tag, and that hold's route.
    position : (3,) world, centre of the tag; normal : (3,) unit, of the wall under it.
    right, up : (3,) world, metres, half of the tag's width and height.
    shown : share of the tag's area on the wall's facet; the facet's edge cuts the rest off.
    """

    hold: int
    route: int
    position: Floats
    normal: Floats
    right: Floats
    up: Floats
    shown: float


def tags(
    canvas: Canvas, facet: Facet, holds: Sequence[GymInstance], rng: np.random.Generator
) -> list[Tag]:
    """Draw paper tags beside the start holds: a band in the route's colour, two lines of text.

    The paper is white, because a dark tag with light text occasionally decodes as an ArUco marker.

    Returns
    -------
    The drawn tags. A later tag may cover an earlier one, and the facet's edge may cut one.
    """
    drawn = []
    for hold in holds:
        if hold.role != "start" or hold.body is None:
            continue
        middle = facet.chart(hold.position) + np.array(
            [rng.uniform(-0.05, 0.05), -hold.body.radius - 0.04]
        )
        turn = np.radians(rng.normal(0, 8))
        along = np.array([np.cos(turn), np.sin(turn)])
        right, up = along * TAG_SIZE[0] / 2, along[::-1] * (-1, 1) * TAG_SIZE[1] / 2
        sheet = np.stack([right / canvas.texel, up / canvas.texel, canvas.pixels(middle)])
        _fill_patch(canvas, sheet, (-1, 1, -1, 1), (0.9, 0.9, 0.88))
        _fill_patch(canvas, sheet, (-1, -0.5, -1, 1), tuple(map(float, hold.rgb)))
        for y in (0.2, -0.5):
            end = float(rng.uniform(0.2, 0.85))
            _fill_patch(canvas, sheet, (-0.3, end, y, y + 0.3), (0.25, 0.25, 0.25))
        across, upward, normal = facet.frame
        axes = np.stack([across, upward])
        position = facet.corners[0] + middle @ axes
        halves = right @ axes, up @ axes
        shown = _share_on_facet(facet, position, *halves)
        drawn.append(Tag(hold.id, hold.route, position, normal, *halves, shown))
    return drawn
