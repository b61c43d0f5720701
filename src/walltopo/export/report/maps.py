"""The report's pictures: the camera path over the wall, and what the photos cover."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.export.report.canvas import (
    Canvas,
    base_colours,
    data_url,
    front_direction,
    paper_view,
)
from walltopo.export.report.coverage import THIN, Spot, count_views, thin_spots
from walltopo.export.report.markup import figure, number, text
from walltopo.export.tiers import Look

__all__ = ["Maps", "draw_maps"]

Floats = NDArray[np.float64]
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
class Maps:
    """HTML of the figures, and the figures of the coverage.

    Parameters
    ----------
    path, coverage : HTML.
    covered : share of the climbing surface that at least `THIN` photos see.
    spots : where more photos would help.
    """

    path: str
    coverage: str
    covered: float
    spots: list[Spot]


def _camera_marks(canvas: Canvas, views: list[View], size: float) -> str:
    """The path from photo to photo, and at each a dot with its viewing direction."""
    centres = canvas.place(np.array([view.centre for view in views]))
    ahead = canvas.place(np.array([v.centre + v.direction * 0.05 * size for v in views]))
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in centres)
    marks = [f'<polyline class="path" points="{line}"/>']
    for view, (x, y), (u, v) in zip(views, centres, ahead, strict=True):
        marks.append(
            f'<line class="look" x1="{x:.1f}" y1="{y:.1f}" x2="{u:.1f}" y2="{v:.1f}"/>'
            f'<circle class="eye" cx="{x:.1f}" cy="{y:.1f}" r="4.5">'
            f"<title>{text(view.name)}</title></circle>"
        )
    return "".join(marks)


def _framed(positions: Floats, views: list[View]) -> Floats:
    """Positions whose picture also has room for the cameras (as triangles of no area)."""
    return np.vstack([positions, *[view.centre[None] for view in views]])


def _path_figures(
    positions: Floats,
    triangles: NDArray[np.int64],
    colours: NDArray[np.uint8],
    front: Floats,
    views: list[View],
) -> str:
    up = np.array([0.0, 0.0, 1.0])
    space = _framed(positions, views)
    size = float(np.ptp(positions, axis=0).max())
    looks = (
        ("From above. The dots are the photos in the order of their names.", -up, -front),
        ("From the front.", -front, up),
    )
    parts = []
    for caption, towards, top in looks:
        canvas = paper_view(space, triangles, towards, top, WIDTH)
        height, width = canvas.face.shape
        faded = (colours.astype(np.uint16) // 2 + 122).astype(np.uint8)
        picture = canvas.picture(faded)
        marks = _camera_marks(canvas, views, size)
        parts.append(figure(data_url(picture), caption, marks, (width, height)))
    return "".join(parts)


def _legend() -> str:
    items = "".join(
        f'<span><i style="background:rgb{colour}"></i>{label}</span>' for _, label, colour in STEPS
    )
    return f'<span class="legend">Photos that see a spot: {items}</span>'


def _coverage_figure(canvas: Canvas, counts: NDArray[np.int32], spots: list[Spot]) -> str:
    starts = [start for start, _, _ in STEPS]
    palette = np.array([colour for _, _, colour in STEPS], dtype=np.uint8)
    colours = palette[np.searchsorted(starts, counts, side="right") - 1]
    marks = []
    for rank, spot in enumerate(spots, start=1):
        x, y = canvas.place(spot.centre[None])[0]
        marks.append(
            f'<circle class="spot" cx="{x:.1f}" cy="{y:.1f}" r="17"/>'
            f'<text class="spot" x="{x:.1f}" y="{y + 6:.1f}">{rank}</text>'
        )
    height, width = canvas.face.shape
    picture = canvas.picture(colours)
    return figure(data_url(picture), _legend(), "".join(marks), (width, height))


def _advice(spots: list[Spot], low: Floats, right: Floats, metric: bool) -> str:
    if not spots:
        return "<p>Every part of the climbing surface is seen by at least 3 photos.</p>"
    unit = "m" if metric else "units"
    items = []
    for spot in spots:
        along = float(spot.centre @ right - low[0])
        height = float(spot.centre[2] - low[1])
        items.append(
            f"<li>{number(along, 1, unit)} from the left end, {number(height, 1, unit)} up: "
            f"{number(spot.area, 2, unit + '²')} seen by {number(spot.views, 1)} photos on "
            "average. <b>Take 3 more photos here</b>, each from another place.</li>"
        )
    return f"<ol>{''.join(items)}</ol>"


def _climbing(
    centres: Floats, normals: Floats, holds: list[dict[str, object]]
) -> NDArray[np.bool_]:
    """Which triangles are climbing surface: not mat, and near the holds where there are any."""
    surface = normals[:, 2] < 0.8
    if len(holds) < 4:
        return surface
    places = np.array([hold["position"] for hold in holds], dtype=np.float64)
    room = 0.06 * float(np.ptp(places, axis=0).max()) + 1e-6
    inside = (centres > places.min(axis=0) - room) & (centres < places.max(axis=0) + room)
    near = surface & inside.all(axis=1)
    return near if near.any() else surface


def draw_maps(
    first: Look,
    views: list[View],
    holds: list[dict[str, object]],
    metric: bool,
) -> Maps:
    """All figures that need the wall and the cameras.

    Parameters
    ----------
    first : the wall's first tier.
    views : registered photos, at least one.
    holds : rows of `holds.json`; they say where the climbing surface is.
    """
    coarse = first.surface
    positions = coarse.positions.astype(np.float64)
    triangles = coarse.triangles.astype(np.int64)
    front = front_direction(positions, triangles)
    up = np.array([0.0, 0.0, 1.0])
    path = _path_figures(positions, triangles, base_colours(coarse, first.picture), front, views)

    counts = count_views(positions, triangles, views)
    canvas = paper_view(positions, triangles, -front, up, WIDTH)
    corners = positions[triangles]
    centres = corners.mean(axis=1)
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(crosses, axis=1)
    normals = crosses / np.maximum(lengths, 1e-12)[:, None]
    climbing = _climbing(centres, normals, holds)
    areas = lengths[climbing] / 2
    seen = counts[climbing] >= THIN
    cell = 0.7 if metric else float(np.ptp(positions, axis=0).max()) / 16
    spots = thin_spots(centres[climbing], areas, counts[climbing], canvas.axes.right, cell)
    low = np.array([(positions @ canvas.axes.right).min(), positions[:, 2].min()])
    return Maps(
        path=path,
        coverage=_coverage_figure(canvas, counts, spots)
        + _advice(spots, low, canvas.axes.right, metric),
        covered=float((areas * seen).sum() / max(areas.sum(), 1e-12)),
        spots=spots,
    )
