"""Route cards for the wall: several on a sheet, with lines to cut along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Final, Literal

from walltopo_gym.errors import RequestError
from walltopo_gym.paper.codes import draw_code
from walltopo_gym.paper.cuts import placed
from walltopo_gym.paper.printable import BOLD, PLAIN, PrintableText
from walltopo_gym.paper.sheet import SIZES
from walltopo_gym.publishing.codes import code_of
from walltopo_gym.publishing.models import Route
from walltopo_gym.words import PAINT, Words

CardSize = Literal["a4", "a5", "a6", "a7"]
MAX_CARDS: Final = 400
_MM: Final = 72 / 25.4
CardPaper = Literal["a4", "letter"]
# Across and down on a sheet; each cut halves, which gives these sizes on A4.
_GRID: Final[dict[CardSize, tuple[int, int]]] = {
    "a4": (1, 1),
    "a5": (1, 2),
    "a6": (2, 2),
    "a7": (2, 4),
}
_INK: Final = "#14181f"
_QUIET: Final = "#566070"


@dataclass(frozen=True)
class Cards:
    """The content of route cards.

    Parameters
    ----------
    routes : one card each; gym : its name; text : an extra line on all of them, or empty.
    base : address of the server.
    """

    routes: Sequence[Route]
    gym: str
    text: str
    base: str

    def pdf(self, words: Words, size: CardSize, paper: CardPaper = "a4") -> tuple[bytes, set[str]]:
        """Return the sheets, and the characters that the font lacks.

        Raises
        ------
        RequestError : more than `MAX_CARDS`.
        """
        from reportlab.pdfgen.canvas import Canvas

        if len(self.routes) > MAX_CARDS:
            raise RequestError("cards-too-many", "cards-choose-wall", most=MAX_CARDS)
        letters, out = PrintableText(), BytesIO()
        sheet = SIZES[paper][0] * _MM, SIZES[paper][1] * _MM
        canvas = Canvas(out, pagesize=sheet, invariant=1)
        canvas.setTitle(letters.text(self.gym))
        across, down = _GRID[size]
        width, height = sheet[0] / across, sheet[1] / down
        for route in placed(canvas, sheet, across, down, self.routes):
            _Card(self, route, words, letters, width, height).draw(canvas)
        canvas.save()
        return out.getvalue(), letters.missing


@dataclass(frozen=True)
class _Card:
    """One card, drawn from its lower left corner; lengths in points."""

    of: Cards
    route: Route
    words: Words
    letters: PrintableText
    width: float
    height: float

    def draw(self, canvas: Any) -> None:
        unit = min(self.width, self.height) / 100
        edge, band = 6 * unit, 12 * unit
        self._draw_band(canvas, band, edge)
        left, room = band + edge + 4 * unit, self.width - band - 2 * edge - 4 * unit
        # On a wide card the code is at the right, else below; the text gets the rest.
        wide = self.width > self.height
        code = 40 * unit if wide else 46 * unit
        draw_code(
            canvas,
            f"{self.of.base}/r/{code_of(self.route.id)}",
            self.width - edge - code,
            edge + (0 if wide else 5 * unit),
            code,
        )
        beside = room - code if wide else room
        # The text ends above the gym's name, and above a code that is below it.
        floor = edge + (7 if wide else 53) * unit
        top = self.height - edge
        if self.route.grade:
            grade = self._fitting(self.route.grade, room, (20, 15, 11), unit)
            canvas.setFillColor(_INK)
            canvas.setFont(BOLD, grade)
            top -= grade * 0.8
            canvas.drawString(left, top, self.letters.cut(self.route.grade, room, grade, bold=True))
            top -= 4 * unit
        name = self.route.name or self.words.colour(self.route.colour)
        size = self._fitting(max(name.split(), key=len, default=""), beside, (10, 8, 6.5), unit)
        if len(self.letters.lines(name, beside, size, 4, bold=True)) > 3:
            size = min(size, 6.5 * unit)
        most = max(1, int((top - floor) / (size * 1.2)))
        top = self._lines(canvas, name, (left, top), beside, size, min(4, most), bold=True)
        setter_line = self.words.say("set_by", name=self.route.setter) if self.route.setter else ""
        for words in filter(None, (setter_line, self.of.text)):
            most = int((top - unit - floor) / (5.75 * unit))
            if most > 0:
                top = self._lines(canvas, words, (left, top - unit), beside, 5 * unit, min(3, most))
        canvas.setFillColor(_QUIET)
        canvas.setFont(PLAIN, 4 * unit)
        room_below = room - (code if wide else 0)
        canvas.drawString(left, edge, self.letters.cut(self.of.gym, room_below, 4 * unit))

    def _fitting(self, words: str, room: float, sizes: Sequence[float], unit: float) -> float:
        """Return the first of these font sizes in which the text fits, else the last, in points."""
        shown = self.letters.text(words)
        for size in sizes:
            if self.letters.width(shown, size * unit, bold=True) <= room:
                break
        return size * unit

    def _draw_band(self, canvas: Any, band: float, edge: float) -> None:
        """Draw the colour, and its name for people who cannot see it."""
        canvas.setFillColor(PAINT.get(self.route.colour, "#ffffff"))
        canvas.setStrokeColor(_QUIET)
        canvas.setLineWidth(0.5)
        canvas.rect(edge, edge, band, self.height - 2 * edge, stroke=1, fill=1)
        size = band * 0.5
        shown = self.letters.cut(
            self.words.colour(self.route.colour), self.height - 4 * edge, size, bold=True
        )
        canvas.saveState()
        canvas.translate(edge + band * 0.67, 2 * edge)
        canvas.rotate(90)
        canvas.setFillColor("#ffffff" if _is_dark(self.route.colour) else _INK)
        canvas.setFont(BOLD, size)
        canvas.drawString(0, 0, shown)
        canvas.restoreState()

    def _lines(
        self,
        canvas: Any,
        words: str,
        at: tuple[float, float],
        room: float,
        size: float,
        most: int,
        *,
        bold: bool = False,
    ) -> float:
        """Draw text below the point `at` and return the height where the next text begins."""
        left, top = at
        canvas.setFillColor(_INK if bold else _QUIET)
        canvas.setFont(BOLD if bold else PLAIN, size)
        for line in self.letters.lines(words, room, size, most, bold=bold):
            top -= size * 1.15
            canvas.drawString(left, top, line)
        return top - size * 0.25


def _is_dark(colour: str) -> bool:
    """Return whether white is more legible on a colour than black (relative luminance, WCAG
    2.2)."""
    paint = PAINT.get(colour)
    if paint is None:
        return False
    parts = [int(paint[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] < 0.18
