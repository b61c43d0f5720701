"""QR codes as drawings: dark modules on white, with the quiet zone that scanners need."""

from __future__ import annotations

from typing import Any

_QUIET = 4  # modules of white around it (ISO/IEC 18004)


def draw_code(canvas: Any, text: str, left: float, bottom: float, size: float) -> None:
    """Draw the code of a text, `size` points high with its quiet zone.

    Parameters
    ----------
    canvas : of reportlab.
    """
    import segno

    code = segno.make(text, error="m", micro=False)
    rows = [bytes(row) for row in code.matrix]
    step = size / (len(rows) + 2 * _QUIET)
    canvas.saveState()
    canvas.setFillGray(1)
    canvas.rect(left, bottom, size, size, stroke=0, fill=1)
    canvas.setFillGray(0)
    path = canvas.beginPath()
    top = bottom + size - _QUIET * step
    for number, row in enumerate(rows):
        at = 0
        while at < len(row):
            end = at
            while end < len(row) and row[end]:
                end += 1
            if end > at:  # one rectangle for each run: no hairlines between modules
                path.rect(
                    left + (_QUIET + at) * step,
                    top - (number + 1) * step,
                    (end - at) * step,
                    step * 1.002,
                )
            at = max(end, at + 1)
    canvas.drawPath(path, stroke=0, fill=1)
    canvas.restoreState()
