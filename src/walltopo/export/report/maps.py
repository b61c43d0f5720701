"""The report's drawings: the camera path over the wall, and what the photos cover."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.export.parallel import front_direction
from walltopo.export.report.canvas import Canvas, base_colours, paper_view
from walltopo.export.report.coverage import THIN, counted_views, thin_spots
from walltopo.export.report.pictures import data_url
from walltopo.export.surface import Look
from walltopo.scans.holds import HoldRow

__all__ = ["CameraMark", "Drawing", "Maps", "SpotMark", "draw_maps"]

Floats = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])
WIDTH = 1000

# Photos that see a spot, and its colour: dark is little, in steps that greyscale keeps apart.
STEPS: tuple[tuple[int, str, tuple[int, int, int]], ...] = (
    (0, "none", (68, 1, 84)),
    (1, "1–2", (59, 82, 139)),
    (THIN, "3–5", (33, 145, 140)),
    (6, "6–11", (94, 201, 98)),
    (12, "12 and more", (253, 231, 37)),
)


@dataclass(frozen=True)
class CameraMark:
    """A photo on a drawing: where it was taken, and a place ahead of it; pixels."""

    name: str
    x: float
    y: float
    ahead_x: float
    ahead_y: float


@dataclass(frozen=True)
class SpotMark:
    """A place that too few photos see, on a drawing and on the wall.

    Parameters
    ----------
    x, y : pixels.
    along, height : from the wall's left end and its lowest point, world units.
    area : square world units that fewer than `THIN` photos see.
    views : mean number of photos over that area.
    """

    x: float
    y: float
    along: float
    height: float
    area: float
    views: float


@dataclass(frozen=True)
class Drawing:
    """A picture of the wall (a `data:` address, its pixels) and what is marked on it."""

    picture: str
    width: int
    height: int
    marks: Sequence[CameraMark | SpotMark]


@dataclass(frozen=True)
class Maps:
    """All drawings, and what they tell.

    Parameters
    ----------
    above, front : the camera path.
    coverage : how many photos see each spot; its marks are where more photos would help.
    covered : share of the climbing surface that at least `THIN` photos see.
    """

    above: Drawing
    front: Drawing
    coverage: Drawing
    covered: float

    legend: ClassVar = [(label, colour) for _, label, colour in STEPS]


def _drawing(
    canvas: Canvas, colours: NDArray[np.uint8], marks: Sequence[CameraMark | SpotMark]
) -> Drawing:
    from PIL import Image

    height, width = canvas.face.shape
    return Drawing(data_url(Image.fromarray(canvas.picture(colours)), 82), width, height, marks)


def _camera_path(
    mesh: Mesh, colours: NDArray[np.uint8], views: Sequence[View], towards: Floats, up: Floats
) -> Drawing:
    """The wall, faded, and over it each photo with its viewing direction."""
    centres = np.array([view.centre for view in views])
    reach = 0.05 * float(np.ptp(mesh.vertices, axis=0).max())
    # The picture must have room for the cameras too.
    space = np.vstack([mesh.vertices, centres])
    canvas = paper_view(space, mesh.faces, towards, up, WIDTH)
    ahead = centres + reach * np.array([view.direction for view in views])
    ends = np.hstack([canvas.place(centres), canvas.place(ahead)]).round(1).tolist()
    marks = [CameraMark(view.name, *places) for view, places in zip(views, ends, strict=True)]
    return _drawing(canvas, (colours.astype(np.uint16) // 2 + 122).astype(np.uint8), marks)


def _climbing(mesh: Mesh, holds: Sequence[HoldRow]) -> NDArray[np.bool_]:
    """(F,) which faces are climbing surface: not mat, and near the holds where there are any."""
    surface = mesh.normals[:, 2] < 0.8
    if len(holds) < 4:
        return surface
    places = np.array([hold.position for hold in holds], dtype=np.float64)
    room = 0.06 * float(np.ptp(places, axis=0).max()) + 1e-6
    low, high = places.min(axis=0) - room, places.max(axis=0) + room
    near = surface & ((mesh.centroids > low) & (mesh.centroids < high)).all(axis=1)
    return near if near.any() else surface


def draw_maps(
    first: Look, views: Sequence[View], holds: Sequence[HoldRow], metric: bool, cache: Path
) -> Maps:
    """All drawings that need the wall and the cameras.

    Parameters
    ----------
    first : the wall's first tier.
    views : registered photos, at least one.
    holds : rows of `holds.json`; they say where the climbing surface is.
    cache : a folder that may be deleted at any time.
    """
    mesh = first.surface.mesh
    front = front_direction(mesh)
    colours = base_colours(first)

    counts = counted_views(mesh, views, cache / "coverage.npz")
    canvas = paper_view(mesh.vertices, mesh.faces, -front, UP, WIDTH)
    climbing = _climbing(mesh, holds)
    areas, seen = mesh.areas[climbing], counts[climbing]
    right = canvas.axes.right
    cell = 0.7 if metric else float(np.ptp(mesh.vertices, axis=0).max()) / 16
    left, bottom = float((mesh.vertices @ right).min()), float(mesh.vertices[:, 2].min())
    marks = []
    for spot in thin_spots(mesh.centroids[climbing], areas, seen, right, cell):
        x, y = canvas.place(spot.centre).round(1).tolist()
        along, height = float(spot.centre @ right) - left, float(spot.centre[2]) - bottom
        marks.append(SpotMark(x, y, along, height, spot.area, spot.views))
    palette = np.array([colour for _, _, colour in STEPS], dtype=np.uint8)
    step = np.searchsorted([start for start, _, _ in STEPS], counts, side="right") - 1
    return Maps(
        above=_camera_path(mesh, colours, views, -UP, -front),
        front=_camera_path(mesh, colours, views, -front, UP),
        coverage=_drawing(canvas, palette[step], marks),
        covered=float((areas * (seen >= THIN)).sum() / max(areas.sum(), 1e-12)),
    )
