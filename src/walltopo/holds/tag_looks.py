"""Cards in one photo: small flat rectangles of white paper on the wall.

A start tag is some 20 pixels of a photo, often seen at a slant. So whatever differs from the
wall around it and is about as large as a card is only a guess; each guess is looked at again in
the wall's plane, where a card is a rectangle of known size whatever the camera did.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.geometry import plane_axes
from walltopo.holds.observations import Picture
from walltopo.holds.tag_fit import GRID, CardFit, fit_card

__all__ = ["CardLook", "CardSizes", "card_looks"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Image = NDArray[np.uint8]

STEPS = (10, 20, 40)  # 8-bit levels by which a guess differs from what is around it
DARKER = 0.75  # of the brightest: the darkest pixel of a guess
SOLID = 0.6  # least share of its convex hull that a guess fills
GAP = 0.09  # longest sides: gaps between lines of print that are closed
GRID_REACH = 1.7  # longest sides in the patch of a guess
MIN_PX = 8  # a card whose longer side has fewer pixels shows no print
FLAT = 0.01  # metres
SAMPLES = 12  # places along each side of a card at which instances and relief are looked up
ON_INSTANCE = 0.25  # share of a card that must lie on instances for it to lie on one
LEAST_FACING = 0.3  # cosine of the angle at which the wall may be seen
HOPELESS = 0.35  # of `third side` at the first turn: no other turn makes a card of it
TURNS_DEG = (0.0, -8.0, 8.0)  # the guess's outline tells its turn only roughly


@dataclass(frozen=True)
class CardSizes:
    """How large a card may be, scan units.

    Parameters
    ----------
    shortest, longest : least length of its shorter side, largest of its longer side.
    flat : how far the mesh under it may stand out of the wall's plane.
    """

    shortest: float
    longest: float
    flat: float

    @classmethod
    def of(cls, settings: ClassifySettings, unit: float) -> CardSizes:
        """The sizes that settings ask for; `unit`: scan units a metre."""
        return cls(settings.tag_shortest * unit, settings.tag_longest * unit, FLAT * unit)


@dataclass(frozen=True, eq=False)
class CardLook:
    """What looks like a card in one photo.

    Parameters
    ----------
    photo : its number.
    position : (3,) middle; normal : (3,) of the wall there; right : (3,) unit, along its longer
        side; world frame.
    width, height : of the longer and of the shorter side, scan units.
    evidence : see `tag_fit.EVIDENCE`.
    linear : (3,) linear RGB of its coloured band as the photo has it; None without one.
    pixels : of the card in the photo.
    instance : the instance it lies on, 0 = wall.
    relief : how far the mesh under it stands out of the wall's plane, scan units (90 % of it
        less than that).
    """

    photo: int
    position: Floats
    normal: Floats
    right: Floats
    width: float
    height: float
    evidence: Floats
    linear: Floats | None
    pixels: int
    instance: int
    relief: float


def card_looks(picture: Picture, mesh: Mesh, sizes: CardSizes) -> Iterator[CardLook]:
    """Whatever in a photo might be a card; each place once.

    Parameters
    ----------
    mesh : whose triangles `picture.face_id` names.
    """
    for outline in _guesses(picture, sizes):
        plane = _plane(picture, mesh, outline, sizes)
        if plane is not None:
            look = _look(picture, mesh, plane, outline, sizes)
            if look is not None:
                yield look


def _guesses(picture: Picture, sizes: CardSizes) -> list[Ints]:
    """Outlines (n, 2) of what differs from its surroundings and is about as large as a card.

    On the wall by what differs in any way (on a light wall print and band alone do), and by what
    is whiter (a card beside a scuff is). On instances by what is whiter: a detector may have
    taken a card for a hold.
    """
    import cv2

    seen = picture.face_id >= 0
    if not seen.any():
        return []
    scale = picture.view.camera.fx * sizes.longest / float(np.median(picture.depth[seen]))
    smooth = cv2.GaussianBlur(picture.pixels, (0, 0), 0.6)
    around = cv2.medianBlur(smooth, int(np.clip(2 * scale, 15, 99)) | 1)
    grey = _most(smooth)
    differs = _most(cv2.absdiff(smooth, around))
    whiter = np.asarray(cv2.subtract(_least(smooth), _least(around)), dtype=np.uint8)
    kernel = np.ones((int(np.clip(GAP * scale, 2, 12)) | 1,) * 2, np.uint8)
    found: dict[tuple[int, int, int], Ints] = {}
    wall, instances = seen & (picture.ids == 0), picture.ids > 0
    for allowed, off in ((wall, differs), (wall, whiter), (instances, whiter)):
        for step in STEPS:
            mask = ((off > step) & allowed).astype(np.uint8)
            closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, kernel)
            outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            for outline in (np.asarray(points, dtype=np.int32) for points in outlines):
                key = _key(picture, outline, sizes)
                if key is not None and _printed(grey, outline):
                    found.setdefault(key, outline[:, 0])
    return list(found.values())


def _most(image: Any) -> Image:
    """(h, w) the largest of the three channels; numpy takes ten times as long."""
    import cv2

    first, second, third = cv2.split(image)
    return np.asarray(cv2.max(cv2.max(first, second), third), dtype=np.uint8)


def _least(image: Any) -> Image:
    """(h, w) the smallest of the three channels."""
    import cv2

    first, second, third = cv2.split(image)
    return np.asarray(cv2.min(cv2.min(first, second), third), dtype=np.uint8)


def _printed(grey: Image, outline: Ints) -> bool:
    """Whether there is something clearly darker than the rest in an outline's box."""
    import cv2

    x, y, width, height = cv2.boundingRect(outline)
    box = grey[y : y + height, x : x + width]
    return bool(box.min() < DARKER * box.max())


def _key(picture: Picture, outline: Ints, sizes: CardSizes) -> tuple[int, int, int] | None:
    """Place and size of an outline in steps of some pixels; None where it is no card's."""
    import cv2

    if len(outline) < MIN_PX:
        return None
    (x, y), extent, _ = cv2.minAreaRect(outline)
    long, short = max(extent) + 1, min(extent) + 1
    rows, columns = picture.depth.shape
    depth = float(picture.depth[min(round(y), rows - 1), min(round(x), columns - 1)])
    size = long * depth / picture.view.camera.fx
    if long < MIN_PX or short < 3 or not sizes.shortest < size < 1.15 * sizes.longest:
        return None
    hull = float(cv2.contourArea(cv2.convexHull(outline)))
    if cv2.contourArea(outline) < SOLID * hull:
        return None
    return round(x / 3), round(y / 3), round(long / 4)


@dataclass(frozen=True, eq=False)
class _Plane:
    """The wall's plane under a guess.

    Parameters
    ----------
    origin : (3,) a point of it under the guess; axes : (2, 3) unit, right and down along it.
    normal : (3,) unit, out of the wall.
    pixel_from_plane : (3, 3) homography; plane coordinates are scan units along the axes.
    """

    origin: Floats
    axes: Floats
    normal: Floats
    pixel_from_plane: Floats


def _wall_under(picture: Picture, mesh: Mesh, outline: Ints, flat: float) -> tuple[Floats, Floats]:
    """A point of the wall's plane around an outline, and its normal.

    Trimmed least squares on the triangles seen around the outline that belong to no instance,
    or on all of them where there are too few.
    """
    low, high = outline.min(axis=0), outline.max(axis=0) + 1
    pad = np.maximum(high - low, 6)
    rows = slice(max(low[1] - pad[1], 0), high[1] + pad[1], 2)
    columns = slice(max(low[0] - pad[0], 0), high[0] + pad[0], 2)
    faces = picture.face_id[rows, columns]
    wall = faces[(faces >= 0) & (picture.ids[rows, columns] == 0)]
    numbers = np.unique(wall if len(wall) >= 12 else faces[faces >= 0])
    points = mesh.vertices[mesh.faces[numbers].ravel()]
    near, middle, normal = points, points[0], np.zeros(3)
    for _ in range(3):
        middle = near.mean(axis=0)
        normal = np.linalg.eigh(np.cov((near - middle).T))[1][:, 0]
        off = np.abs((points - middle) @ normal)
        near = points[off <= max(2.5 * float(np.median(off)), 0.2 * flat)]
    return middle, normal


def _plane(picture: Picture, mesh: Mesh, outline: Ints, sizes: CardSizes) -> _Plane | None:
    """The plane of the wall around an outline; None where it is seen at too flat an angle."""
    import cv2

    x, y = np.round(outline.mean(axis=0)).astype(int)
    own = int(picture.face_id[y, x])
    if own < 0:
        return None
    middle, normal = _wall_under(picture, mesh, outline, sizes.flat)
    towards = picture.view.centre - middle
    normal = normal if normal @ towards > 0 else -normal
    if normal @ towards < LEAST_FACING * np.linalg.norm(towards):
        return None
    right, up = plane_axes(normal)
    axes = np.stack([right, -up])
    place = mesh.centroids[own]
    origin = place - ((place - middle) @ normal) * normal
    # Four corners of a card's size: the lens bends nothing over so short a way.
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * sizes.longest
    pixels = picture.view.project(origin + square @ axes)
    if not np.isfinite(pixels).all():
        return None
    homography = cv2.getPerspectiveTransform(square.astype(np.float32), pixels.astype(np.float32))
    return _Plane(origin, axes, normal, np.asarray(homography, dtype=np.float64))


def _look(
    picture: Picture, mesh: Mesh, plane: _Plane, outline: Ints, sizes: CardSizes
) -> CardLook | None:
    """The best card around a guess, over small turns; None where none fits."""
    import cv2

    inverse = np.linalg.inv(plane.pixel_from_plane)
    flat = cv2.perspectiveTransform((outline[None] + 0.5).astype(np.float64), inverse)[0]
    middle, extent, angle = cv2.minAreaRect(flat.astype(np.float32))
    if max(extent) > 1.3 * sizes.longest or min(extent) < 0.3 * sizes.shortest:
        return None
    step = GRID_REACH * sizes.longest / GRID
    half = np.array([extent[0], extent[1]]) / 2 / step
    (x0, y0), (x1, y1) = np.round([GRID / 2 - half, GRID / 2 + half]).astype(int).tolist()
    best: tuple[CardFit, float] | None = None
    for turn in np.radians(np.array(TURNS_DEG) + angle).tolist():
        patch = _patch(picture, plane, np.array(middle), turn, step)
        fit = fit_card(patch, (x0, x1, y0, y1))
        if fit is not None and (best is None or fit.straight > best[0].straight):
            best = (fit, turn)
        if best is None or best[0].evidence[1] < HOPELESS:
            return None
    return (
        None
        if best is None
        else _described(picture, mesh, plane, np.array(middle), step, *best, sizes)
    )


def _turned(turn: float) -> Floats:
    """(2, 2) along and across a card of this turn, in the plane's axes."""
    return np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])


def _patch(picture: Picture, plane: _Plane, middle: Floats, turn: float, step: float) -> Image:
    """(GRID, GRID, 3) the wall around a place, its axes along those of a turned card."""
    import cv2

    frame = np.eye(3)
    frame[:2, :2] = _turned(turn).T * step
    frame[:2, 2] = middle - frame[:2, :2] @ (GRID / 2, GRID / 2)
    centres = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])  # pixel (0, 0) covers 0 to 1
    to_pixel = np.linalg.inv(centres) @ plane.pixel_from_plane @ frame @ centres
    patch = cv2.warpPerspective(
        picture.pixels,
        to_pixel,
        (GRID, GRID),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(patch, dtype=np.uint8)


def _described(
    picture: Picture,
    mesh: Mesh,
    plane: _Plane,
    middle: Floats,
    step: float,
    fit: CardFit,
    turn: float,
    sizes: CardSizes,
) -> CardLook | None:
    """The look of a fitted card; None if its size is not a card's or it is no part of the photo."""
    x0, x1, y0, y1 = fit.box
    along, across = _turned(turn)
    place = middle + step * ((x0 + x1 - GRID) / 2 * along + (y0 + y1 - GRID) / 2 * across)
    width, height = (x1 - x0) * step, (y1 - y0) * step
    if height > width:
        width, height, along, across = height, width, across, along
    if width > sizes.longest or height < sizes.shortest:
        return None
    grid = np.linspace(-0.5, 0.5, SAMPLES)
    over = np.stack(np.meshgrid(grid * width, grid * height), axis=-1).reshape(-1, 2)
    world = plane.origin + (place + over @ np.stack([along, across])) @ plane.axes
    column, row = np.floor(picture.view.project(world)).astype(int).T
    rows, columns = picture.face_id.shape
    if min(row.min(), column.min()) < 0 or row.max() >= rows or column.max() >= columns:
        return None
    faces, ids = picture.face_id[row, column], picture.ids[row, column]
    if faces.min() < 0:
        return None
    labels, counts = np.unique(ids[ids > 0], return_counts=True)
    on_wall = len(labels) == 0 or counts.sum() < ON_INSTANCE * len(ids)
    heights = np.abs((mesh.centroids[faces] - plane.origin) @ plane.normal)
    return CardLook(
        picture.number,
        plane.origin + place @ plane.axes,
        plane.normal,
        along @ plane.axes,
        width,
        height,
        fit.evidence,
        fit.linear,
        int(np.ptp(row) * np.ptp(column)),
        0 if on_wall else int(labels[counts.argmax()]),
        float(np.percentile(heights, 90)),
    )
