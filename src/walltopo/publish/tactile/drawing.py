"""The drawing of a route for swell paper, whose black parts rise when it is heated."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.files import atomic_path
from walltopo.publish.tactile.braille import DOT_M, braille_dots
from walltopo.publish.tactile.relief import PITCH_M, Relief

Bitmap = NDArray[np.bool_]

_PAPERS_M: Final = ((0.210, 0.297), (0.297, 0.420))  # A4, A3
_EDGE_M: Final = 0.008
_POINTS: Final = 72 / 0.0254  # PDF units per metre
_LINE_M: Final = 0.001
_RING_M: Final = 0.0025  # between a hold and its ring


def write_drawing(path: Path, relief: Relief) -> None:
    """Write a PDF of one page: holds black, starts in one ring, tops in two, volumes as outlines.

    Raises
    ------
    InputError : the relief is larger than A3. EnvironmentLacksError : reportlab is missing.
    """
    try:
        from reportlab.pdfgen.canvas import Canvas
    except ImportError as error:
        raise EnvironmentLacksError(
            f"the drawing needs reportlab ({error})", "pip install 'walltopo[tactile]'"
        ) from error
    width, height = relief.size
    paper = next(
        (p for p in _PAPERS_M if width + 2 * _EDGE_M <= p[0] and height + 2 * _EDGE_M <= p[1]),
        None,
    )
    if paper is None:
        raise InputError(
            f"the drawing is {width * 100:.0f} x {height * 100:.0f} cm, larger than A3",
            "Export a shorter route.",
        )
    with atomic_path(path) as temporary:
        canvas = Canvas(str(temporary), pagesize=(paper[0] * _POINTS, paper[1] * _POINTS))
        canvas.setTitle(relief.label)
        canvas.scale(_POINTS, _POINTS)
        canvas.translate((paper[0] - width) / 2, (paper[1] + height) / 2)
        canvas.scale(1, -1)  # from here on, y goes down as in the relief
        canvas.setLineWidth(_LINE_M)
        canvas.rect(0, 0, width, relief.at[1] - _EDGE_M / 2)
        _draw_holds(canvas, relief)
        for right, down in braille_dots(relief.label):
            canvas.circle(relief.at[0] + right, relief.at[1] + down, DOT_M / 2, stroke=0, fill=1)
        canvas.showPage()
        canvas.save()


def _draw_holds(canvas: Any, relief: Relief) -> None:
    for mask, fill in ((relief.volumes, 0), (relief.holds, 1)):
        for outline in _part_outlines(mask):
            path = canvas.beginPath()
            path.moveTo(*outline[0])
            for point in outline[1:]:
                path.lineTo(*point)
            path.close()
            canvas.drawPath(path, stroke=1 - fill, fill=fill)
    for marked, rings in ((relief.starts, 1), (relief.tops, 2)):
        for outline in _part_outlines(marked):
            middle = (outline.min(axis=0) + outline.max(axis=0)) / 2
            reach = float(np.linalg.norm(outline - middle, axis=1).max())
            for ring in range(1, rings + 1):
                canvas.circle(*middle, reach + ring * _RING_M, stroke=1, fill=0)


def _part_outlines(mask: Bitmap) -> Iterator[NDArray[np.float64]]:
    """Yield the (n, 2) outline of each part of a mask, m from the left and the upper edge."""
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    for outline in found:
        if len(outline) >= 3:
            yield outline[:, 0].astype(np.float64) * PITCH_M
