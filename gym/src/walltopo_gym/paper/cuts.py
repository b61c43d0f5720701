"""Lines to cut along, between the cards of a sheet."""

from __future__ import annotations

from typing import Any


def draw_cuts(canvas: Any, sheet: tuple[float, float], across: int, down: int) -> None:
    """Draw dashed lines between cards, so many across and down a sheet.

    Parameters
    ----------
    sheet : width and height in points.
    """
    canvas.setStrokeGray(0.6)
    canvas.setLineWidth(0.4)
    canvas.setDash(3, 3)
    for number in range(1, across):
        canvas.line(sheet[0] * number / across, 0, sheet[0] * number / across, sheet[1])
    for number in range(1, down):
        canvas.line(0, sheet[1] * number / down, sheet[0], sheet[1] * number / down)
    canvas.setDash()
