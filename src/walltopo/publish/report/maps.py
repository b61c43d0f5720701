"""Draw the report's maps of the wall: camera path, coverage, front and plan views."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, View
from walltopo.images.files import open_picture
from walltopo.publish.atlas.visible_faces import (
    Axes,
    axes_towards,
    front_direction,
    render_parallel,
)
from walltopo.publish.coverage import MIN_PHOTOS, low_coverage_spots
from walltopo.publish.surface import TexturedSurface
from walltopo.publish.texture_image import texels
from walltopo.scans.holds import Hold

Floats = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])

WIDTH = 1000

# Number of photos that see a spot, and its colour: dark for few, in steps distinct in greyscale.
STEPS: tuple[tuple[int, str, tuple[int, int, int]], ...] = (
    (0, "none", (68, 1, 84)),
    (1, "1–2", (59, 82, 139)),
    (MIN_PHOTOS, "3–5", (33, 145, 140)),
    (6, "6–11", (94, 201, 98)),
    (12, "12 and more", (253, 231, 37)),
)


@dataclass(frozen=True)
class CameraMark:
    """A photo on a drawing: its position, and a point ahead of it; pixels."""

    name: str
    x: float
    y: float
    ahead_x: float
    ahead_y: float


@dataclass(frozen=True)
class SpotMark:
    """A spot that too few photos see, on a drawing and on the wall.

    Parameters
    ----------
    x, y : pixels.
    along, height : from the wall's left end and its lowest point, world units.
    area : square world units that fewer than `MIN_PHOTOS` photos see.
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
    """A picture of the wall (a `data:` URL, its size in pixels) and its marks."""

    picture: str
    width: int
    height: int
    marks: Sequence[CameraMark | SpotMark]


@dataclass(frozen=True)
class Maps:
    """All drawings of the report.

    Parameters
    ----------
    above, front : the camera path.
    coverage : number of photos that see each spot; the marks show where more photos would help.
    covered : share of the climbing surface that at least `MIN_PHOTOS` photos see.
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
    """Return the faded wall, with each photo and its viewing direction."""
    centres = np.array([view.centre for view in views])
    reach = 0.05 * float(np.ptp(mesh.vertices, axis=0).max())
    # The picture must have room for the cameras.
    space = np.vstack([mesh.vertices, centres])
    canvas = paper_view(space, mesh.faces, towards, up, WIDTH)
    ahead = centres + reach * np.array([view.direction for view in views])
    ends = np.hstack([canvas.place(centres), canvas.place(ahead)]).round(1).tolist()
    marks = [CameraMark(view.name, *places) for view, places in zip(views, ends, strict=True)]
    return _drawing(canvas, (colours.astype(np.uint16) // 2 + 122).astype(np.uint8), marks)


def _climbing_faces(mesh: Mesh, holds: Sequence[Hold]) -> NDArray[np.bool_]:
    """Return (F,) which faces are climbing surface: no mat, and near the holds if there are any."""
    surface = mesh.normals[:, 2] < 0.8
    if len(holds) < 4:
        return surface
    places = np.array([hold.position for hold in holds], dtype=np.float64)
    room = 0.06 * float(np.ptp(places, axis=0).max()) + 1e-6
    low, high = places.min(axis=0) - room, places.max(axis=0) + room
    near = surface & ((mesh.centroids > low) & (mesh.centroids < high)).all(axis=1)
    return near if near.any() else surface


def draw_maps(
    first: TexturedSurface,
    counts: NDArray[np.int32],
    views: Sequence[View],
    holds: Sequence[Hold],
    metric: bool,
) -> Maps:
    """Return all drawings that need the wall and the cameras.

    Parameters
    ----------
    first : the wall's first tier; counts : the number of photos that see each of its triangles.
    views : registered photos, at least one.
    holds : rows of `holds.json`; their extent defines the climbing surface.
    """
    mesh = first.surface.mesh
    front = front_direction(mesh)
    colours = base_colours(first)

    canvas = paper_view(mesh.vertices, mesh.faces, -front, UP, WIDTH)
    climbing = _climbing_faces(mesh, holds)
    areas, seen = mesh.areas[climbing], counts[climbing]
    right = canvas.axes.right
    cell = 0.7 if metric else float(np.ptp(mesh.vertices, axis=0).max()) / 16
    left, bottom = float((mesh.vertices @ right).min()), float(mesh.vertices[:, 2].min())
    marks = []
    for spot in low_coverage_spots(mesh.centroids[climbing], areas, seen, right, cell):
        x, y = canvas.place(spot.centre).round(1).tolist()
        along, height = float(spot.centre @ right) - left, float(spot.centre[2]) - bottom
        marks.append(SpotMark(x, y, along, height, spot.area, spot.views))
    palette = np.array([colour for _, _, colour in STEPS], dtype=np.uint8)
    step = np.searchsorted([start for start, _, _ in STEPS], counts, side="right") - 1
    return Maps(
        above=_camera_path(mesh, colours, views, -UP, -front),
        front=_camera_path(mesh, colours, views, -front, UP),
        coverage=_drawing(canvas, palette[step], marks),
        covered=float((areas * (seen >= MIN_PHOTOS)).sum() / max(areas.sum(), 1e-12)),
    )


PAPER = (245, 246, 248)


@dataclass(frozen=True, eq=False)
class Canvas:
    """A drawing plane: the projection of world points, and the face at each pixel.

    Parameters
    ----------
    axes : the picture's directions.
    origin : (2,) plane coordinates of the top-left corner, world units.
    scale : pixels per world unit.
    face : (H, W) int32 face index, -1 = none.
    """

    axes: Axes
    origin: Floats
    scale: float
    face: NDArray[np.int32]

    def place(self, points: Floats) -> Floats:
        """Return (..., 2) pixels of (..., 3) world points."""
        return (self.axes.flat(points) - self.origin) * self.scale

    def picture(self, face_colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the (H, W, 3) picture with the given (F, 3) colours."""
        table = np.vstack([face_colours, np.array([PAPER], dtype=np.uint8)])
        return table[self.face]


def paper_view(
    positions: Floats, triangles: NDArray[np.int32], towards: Floats, up: Floats, width: int
) -> Canvas:
    """Return an orthographic drawing.

    Parameters
    ----------
    positions : (V, 3), world frame.
    towards : (3,) unit, the viewing direction.
    up : (3,) unit, up in the picture.
    width : pixels; the height follows, at most twice the width.
    """
    axes = axes_towards(towards, up)
    plane = axes.flat(positions)
    low, high = plane.min(axis=0), plane.max(axis=0)
    size = np.maximum(high - low, 1e-6)
    origin = low - 0.04 * size.max()
    extent = size + 0.08 * size.max()
    scale = width / float(extent[0])
    height = int(np.clip(round(extent[1] * scale), 16, 2 * width))
    face = render_parallel(positions, triangles, axes, origin, scale, (width, height))
    return Canvas(axes, origin, scale, face)


def base_colours(textured: TexturedSurface) -> NDArray[np.uint8]:
    """Return (T, 3) one colour per triangle: from the texture, the vertices, or shaded grey."""
    surface, corners = textured.surface, textured.surface.mesh.faces
    if surface.uv is not None and textured.picture is not None:
        return texels(textured.picture, surface.uv[corners].mean(axis=1))
    if surface.colours is not None:
        return surface.colours[corners].mean(axis=1).astype(np.uint8)
    shade = 130 + 90 * np.abs(surface.normals[corners].mean(axis=1) @ np.array([0.5, 0.4, 0.76]))
    return np.repeat(shade[:, None], 3, axis=1).astype(np.uint8)


def data_url(picture: Any, quality: int) -> str:
    """Return a Pillow image as a `data:` URL."""
    stream = BytesIO()
    picture.save(stream, "WEBP", quality=quality)
    return "data:image/webp;base64," + base64.b64encode(stream.getvalue()).decode("ascii")


def thumbnail(path: Path, longest: int) -> str | None:
    """Return a small copy of a picture as a `data:` URL, or None if it is unreadable."""
    try:
        with open_picture(path) as opened:
            opened.thumbnail((longest, longest))
            return data_url(opened.convert("RGBA" if opened.mode == "RGBA" else "RGB"), 72)
    except InputError:
        return None
