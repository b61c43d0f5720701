"""A sheet with the code of a judge's link for each problem of a round, with lines to cut along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Final, Literal

from walltopo_gym.paper.codes import draw_code
from walltopo_gym.paper.cuts import placed
from walltopo_gym.paper.printable import BOLD, PLAIN, PrintableText
from walltopo_gym.paper.sheet import SIZES
from walltopo_gym.words import Words

SheetSize = Literal["a4", "letter"]
_MM: Final = 72 / 25.4
_ACROSS, _DOWN = 2, 3
_EDGE: Final = 8 * _MM
_CODE: Final = 48 * _MM
_INK: Final = "#14181f"
_QUIET: Final = "#566070"


@dataclass(frozen=True)
class JudgeCode:
    """A code to print.

    Parameters
    ----------
    title : the problem, by its number or label; name : the route's name or colour, or empty.
    link : address that the code leads to.
    """

    title: str
    name: str
    link: str


def judge_sheet(
    codes: Sequence[JudgeCode], competition: str, one: str, words: Words, size: SheetSize
) -> tuple[bytes, set[str]]:
    """Return the sheets as PDF, and the characters that the font lacks.

    Parameters
    ----------
    competition, one : names of the competition and the round.
    """
    from reportlab.pdfgen.canvas import Canvas

    letters, out = PrintableText(), BytesIO()
    sheet = SIZES[size][0] * _MM, SIZES[size][1] * _MM
    canvas = Canvas(out, pagesize=sheet, invariant=1)
    canvas.setTitle(letters.text(competition))
    width, height = sheet[0] / _ACROSS, sheet[1] / _DOWN
    for code in placed(canvas, sheet, _ACROSS, _DOWN, codes):
        _draw_code(canvas, code, f"{competition} · {one}", words, letters, width, height)
    canvas.save()
    return out.getvalue(), letters.missing


def _draw_code(
    canvas: Any,
    code: JudgeCode,
    where: str,
    words: Words,
    letters: PrintableText,
    width: float,
    height: float,
) -> None:
    """Draw one code from its lower left corner; lengths in points."""
    room, middle = width - 2 * _EDGE, width / 2
    top = height - _EDGE
    for text, font, points, colour in (
        (where, PLAIN, 8, _QUIET),
        (code.title, BOLD, 17, _INK),
        (code.name, PLAIN, 10, _INK),
    ):
        if text:
            top -= points
            canvas.setFillColor(colour)
            canvas.setFont(font, points)
            line = letters.cut(text, room, points, bold=font == BOLD)
            canvas.drawCentredString(middle, top, line)
            top -= points * 0.4
    draw_code(canvas, code.link, middle - _CODE / 2, top - _CODE, _CODE)
    top -= _CODE
    canvas.setFillColor(_QUIET)
    canvas.setFont(PLAIN, 8)
    for line in letters.lines(words.say("judge_scan"), room, 8, 2):
        top -= 10
        canvas.drawCentredString(middle, top, line)
