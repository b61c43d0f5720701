"""The relief of a route: the wall at a scale of 1:20 with the route's holds raised.

It is a map of heights over the plane that fits the wall around the route, so that an overhanging
wall is printed lying on its back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.geometry.zbuffer import draw_screen
from walltopo.images.fill import spread_colours
from walltopo.publish.atlas.visible_faces import Axes, axes_towards, to_screen
from walltopo.publish.tactile.braille import DOT_M, RAISED_M, braille_dots, braille_width
from walltopo.publish.wall_data import WallModel
from walltopo.scans.routes import Route, route_name

Floats = NDArray[np.float64]
Bitmap = NDArray[np.bool_]

SCALE: Final = 20  # a metre of wall is five centimetres
PITCH_M: Final = 0.0004  # of the print, between heights: the usual nozzle
_BASE_M: Final = 0.002  # of the print, below the lowest place
_MIN_RAISED_M: Final = 0.001  # of the print; estimated, no blind reader has tried it
_MAX_DEPTH_M: Final = 0.04  # of the print: deeper corners are cut off
_AROUND_M: Final = 0.25  # of wall, left, right, above and below the route's holds
_RIM: Final = 7  # pixels, of holds and their borders that are taken off the wall
# The wall's roughness is that of its measurement, and hides small holds from the fingers; edges of
# volumes and corners are larger and stay.
_SMOOTH_M: Final = 0.002
_EDGE_M: Final = 0.001
_RINGS_M: Final = ((0.0012, 0.0020), (0.0030, 0.0038))  # of the print, around a hold: from, to
_FLOOR_M: Final = 0.03  # of wall: what lies lower is the floor
_LABEL_M: Final = 0.012  # of the print, below the wall
_MARGIN_M: Final = 0.003
_LINE_M: Final = 0.15  # of the print, longest label


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights of a print.

    Parameters
    ----------
    heights : (H, W) m above the print's underside; the first row is the upper edge.
    holds : the (H, W) pixels of the route's holds; starts and tops : of those; volumes : likewise.
    label : the text in Braille below the wall, m from the left and from the upper edge: `at`.
    """

    heights: Floats
    holds: Bitmap
    starts: Bitmap
    tops: Bitmap
    volumes: Bitmap
    label: str
    at: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Return width and height of the print, m."""
        rows, columns = self.heights.shape
        return (columns - 1) * PITCH_M, (rows - 1) * PITCH_M


def route_relief(wall: WallModel, route: Route) -> Relief:
    """Return the relief of a route.

    Parameters
    ----------
    wall : the whole wall, in metres.

    Raises
    ------
    InputError : the scan has no scale, or the route no holds.
    """
    if not wall.metric:
        raise InputError(
            "the scan has no scale, so a relief in true scale cannot be made",
            "Scan with the printed scale plate, or set a known distance (`--set scale.distance`).",
        )
    members = set(route.holds)
    if not members:
        raise InputError(f"{route_name(route)} has no holds")
    label = _label_of(route)
    front = _Front.of(wall, members, braille_width(label) + 2 * _MARGIN_M)
    face, near = front.draw(wall)
    instance = np.where(face >= 0, wall.face_instance[face], 0)
    volumes = [hold.id for hold in wall.holds if hold.kind == "volume"]
    is_hold = (instance > 0) & ~np.isin(instance, volumes)
    own = np.isin(instance, list(members))
    rim = cv2.dilate(is_hold.astype(np.uint8), np.ones((_RIM, _RIM), np.uint8)) > 0
    base = _base_of(near, (face >= 0) & ~rim)
    heights = np.where(own, np.maximum(near, base + _MIN_RAISED_M), base)
    starts, tops = (np.isin(instance, ids) for ids in (route.start, route.top))
    for count, marked in ((1, starts), (2, tops)):
        heights += _MIN_RAISED_M * (_ring_pixels(marked, count) & ~own)
    masks = (own, starts, tops, np.isin(instance, volumes))
    return _add_label_strip(heights, masks, label)


@dataclass(frozen=True, eq=False)
class _Front:
    """The plane of a relief: its axes, upper left corner (see `to_screen`), and size in pixels.

    A pixel is `PITCH_M` of the print.
    """

    axes: Axes
    origin: Floats
    width: int
    height: int

    @classmethod
    def of(cls, wall: WallModel, members: set[int], width: float) -> _Front:
        """Return the plane of the wall around some holds, at least `width` m of the print wide."""
        corners = wall.mesh.vertices[wall.mesh.faces[np.isin(wall.face_instance, list(members))]]
        points = corners.reshape(-1, 3)
        low, high = points.min(axis=0) - _AROUND_M, points.max(axis=0) + _AROUND_M
        inside = ((wall.mesh.centroids > low) & (wall.mesh.centroids < high)).all(axis=1)
        around = inside & (wall.face_instance == 0)
        chosen = around if around.any() else inside
        out = wall.mesh.areas[chosen] @ wall.mesh.normals[chosen]
        axes = axes_towards(-out, np.array([0.0, 0.0, 1.0]))
        local = points @ np.column_stack([axes.right, axes.down])
        begin, end = local.min(axis=0) - _AROUND_M, local.max(axis=0) + _AROUND_M
        lacking = max(width * SCALE - float(end[0] - begin[0]), 0.0)
        begin[0], end[0] = begin[0] - lacking / 2, end[0] + lacking / 2
        columns, rows = np.ceil((end - begin) / (PITCH_M * SCALE)).astype(int).tolist()
        return cls(axes, begin, columns, rows)

    def draw(self, wall: WallModel) -> tuple[NDArray[np.int32], Floats]:
        """Return the triangle at each pixel (-1: none) and its height over a far plane, m of the
        print.
        """
        vertices = wall.mesh.vertices
        far = float((vertices @ self.axes.towards).max()) + 1.0
        screen = to_screen(vertices, self.axes, self.origin, 1 / (PITCH_M * SCALE), far)
        screen[vertices[:, 2] < _FLOOR_M, 2] = 0.0  # not drawn
        face, near = draw_screen(screen, wall.mesh.faces, self.width, self.height)
        return face, near * PITCH_M


def _base_of(heights: Floats, known: Bitmap) -> Floats:
    """Return the wall without holds: unknown heights follow from those around, m of the print."""
    if not known.any():
        raise InputError("no wall is visible around the route")
    wall = heights[known]
    floor = max(float(wall.min()), float(np.percentile(wall, 90)) - _MAX_DEPTH_M)
    weight = known.astype(np.float32)
    clipped = np.clip(heights, floor, floor + _MAX_DEPTH_M).astype(np.float32) * weight
    filled = spread_colours(np.repeat(clipped[..., None], 3, axis=2), weight)[..., 0]
    smooth = cv2.bilateralFilter(filled.astype(np.float32), -1, _EDGE_M, _SMOOTH_M / PITCH_M)
    return np.asarray(smooth, np.float64)


def _ring_pixels(marked: Bitmap, count: int) -> Bitmap:
    """Return the pixels of one or two rings around marked holds."""
    away = cv2.distanceTransform((~marked).astype(np.uint8), cv2.DIST_L2, 5) * PITCH_M
    rings = np.zeros_like(marked)
    for begin, end in _RINGS_M[:count]:
        rings |= (away >= begin) & (away <= end)
    return rings if marked.any() else np.zeros_like(marked)


def _label_of(route: Route) -> str:
    """Return the route's name, as much of it as fits on a line of Braille."""
    label = route_name(route)
    while braille_width(label) > _LINE_M:
        label = label[:-1].rstrip()
    return label


def _add_label_strip(heights: Floats, masks: tuple[Bitmap, ...], label: str) -> Relief:
    """Return the relief on its base, with a strip for the label below; masks as in `Relief`."""
    strip = round(_LABEL_M / PITCH_M)
    heights = np.pad(heights - heights.min() + _BASE_M, ((0, strip), (0, 0)))
    rows = heights.shape[0] - strip
    heights[rows:] = _BASE_M
    at = _MARGIN_M, rows * PITCH_M + _MARGIN_M
    for right, down in braille_dots(label):
        _raise_dot(heights, at[0] + right, at[1] + down)
    holds, starts, tops, volumes = (np.pad(mask, ((0, strip), (0, 0))) for mask in masks)
    return Relief(heights, holds, starts, tops, volumes, label, at)


def _raise_dot(heights: Floats, x: float, y: float) -> None:
    """Add a dome at a place, m from the left and the upper edge, in place."""
    reach = int(np.ceil(DOT_M / PITCH_M))
    row, column = round(y / PITCH_M), round(x / PITCH_M)
    for r in range(max(row - reach, 0), min(row + reach + 1, heights.shape[0])):
        for c in range(max(column - reach, 0), min(column + reach + 1, heights.shape[1])):
            share = np.hypot(c * PITCH_M - x, r * PITCH_M - y) / (DOT_M / 2)
            if share < 1:
                dome = _BASE_M + RAISED_M * np.sqrt(1 - share**2)
                heights[r, c] = max(heights[r, c], dome)
