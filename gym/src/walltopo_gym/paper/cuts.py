"""Cards on sheets, with lines to cut along."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, TypeVar

_Card = TypeVar("_Card")


def placed(
    canvas: Any, sheet: tuple[float, float], across: int, down: int, cards: Iterable[_Card]
) -> Iterator[_Card]:
    """Yield each card while the canvas has its origin at the card's lower left corner.

    Parameters
    ----------
    sheet : width and height in points. across, down : number of cards on a sheet.
    """
    width, height = sheet[0] / across, sheet[1] / down
    for number, card in enumerate(cards):
        slot = number % (across * down)
        if slot == 0:
            if number:
                canvas.showPage()
            _draw_cuts(canvas, sheet, across, down)
        canvas.saveState()
        canvas.translate(slot % across * width, sheet[1] - (slot // across + 1) * height)
        yield card
        canvas.restoreState()


def _draw_cuts(canvas: Any, sheet: tuple[float, float], across: int, down: int) -> None:
    """Draw dashed lines between cards, so many across and down a sheet."""
    canvas.setStrokeGray(0.6)
    canvas.setLineWidth(0.4)
    canvas.setDash(3, 3)
    for number in range(1, across):
        canvas.line(sheet[0] * number / across, 0, sheet[0] * number / across, sheet[1])
    for number in range(1, down):
        canvas.line(0, sheet[1] * number / down, sheet[0], sheet[1] * number / down)
    canvas.setDash()
