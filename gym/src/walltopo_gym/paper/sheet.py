"""Pages with a title, paragraphs and tables: the frame of what the platform prints.

    sheet = Sheet("Results", "Spring Cup, 14 March", foot="Gym name", page="Page {page} of {pages}")
sheet.heading("Women")
sheet.table(["#", "Name", "Tops"], [["1", "Jana", "4T5z"]], widths=[1, 6, 2], right={0, 2})
content = sheet.pdf()
sheet.missing    # characters that the font lacks, for the user
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from html import escape
from io import BytesIO
from typing import Any, Final, Literal

from walltopo_gym.paper.codes import draw_code
from walltopo_gym.paper.numbered import numbered_canvas
from walltopo_gym.paper.printable import BOLD, PLAIN, PrintableText, scripts_of

Paper = Literal["a3", "a4", "a5", "a6", "a7", "letter", "tabloid"]
_MM: Final = 72 / 25.4
# ISO 216 and ANSI/ASME Y14.1, millimetres, upright.
SIZES: Final[dict[Paper, tuple[int, int]]] = {
    "a3": (297, 420),
    "a4": (210, 297),
    "a5": (148, 210),
    "a6": (105, 148),
    "a7": (74, 105),
    "letter": (216, 279),
    "tabloid": (279, 432),
}
# All lengths below are those of A4; other sizes scale the same page.
_MARGIN: Final = 15 * _MM
_PICTURE: Final = 0.68  # of the page's width
_INK: Final = "#14181f"
_QUIET: Final = "#566070"
_LINE: Final = "#c9ced6"


class Sheet:
    """A document that is filled from top to bottom.

    Parameters
    ----------
    title, subtitle : at its head, once; foot : at the bottom of each page, on the left.
    page : page number text, with {page} and {pages}; code : address of a QR code beside the title,
        with `code_note` below it; lacks : a last line with {scripts}, where the font lacks some.
    """

    def __init__(
        self,
        title: str,
        subtitle: str = "",
        *,
        foot: str = "",
        page: str = "{page} / {pages}",
        code: str = "",
        code_note: str = "",
        size: Paper = "a4",
        lacks: str = "",
    ) -> None:
        self._letters = PrintableText()
        self._lacks = lacks
        self._title, self._foot, self._page = title, foot, page
        self._scale = SIZES[size][0] / SIZES["a4"][0]
        self._size = tuple(length * _MM / self._scale for length in SIZES[size])
        self._room = self._size[0] - 2 * _MARGIN
        self._parts: list[Any] = []
        self._head(title, subtitle, code, code_note)

    @property
    def missing(self) -> set[str]:
        """Return the characters that the font lacks; question marks replace them."""
        return self._letters.missing

    def heading(self, words: str, *, below: float = 30) -> None:
        """Add a heading, on a page with at least `below` millimetres (of A4) of room after it."""
        from reportlab.platypus import CondPageBreak

        self._parts.append(CondPageBreak(below * _MM))
        self._parts.append(self._paragraph(words, 13, bold=True, before=14))

    def text(self, words: str, *, quiet: bool = False) -> None:
        """Add a paragraph."""
        self._parts.append(self._paragraph(words, 9.5, colour=_QUIET if quiet else _INK, before=3))

    def table(
        self,
        head: Sequence[str],
        rows: Sequence[Sequence[str]],
        *,
        widths: Sequence[float],
        right: Collection[int] = (),
        bold: Collection[int] = (),
        dots: Sequence[str] = (),
    ) -> None:
        """Add rows below a heading that is repeated on each page; an empty one is left out.

        Parameters
        ----------
        widths : of the columns, as shares of the page; right : right-aligned columns; bold : bold
            columns; dots : for each row a colour ("#c32026") before its first cell.
        """
        from reportlab.platypus import Table

        scale = self._room / sum(widths)
        cells = (
            [
                [
                    self._paragraph(cell, 8, colour=_QUIET, right=at in right)
                    for at, cell in enumerate(head)
                ]
            ]
            if head
            else []
        )
        cells += [
            [
                self._paragraph(cell, 9.5, bold=at in bold, right=at in right)
                for at, cell in enumerate(row)
            ]
            for row in rows
        ]
        columns = [width * scale for width in widths]
        if dots:
            first = [*([""] if head else []), *map(_draw_spot, dots)]
            cells = [[left, *row] for left, row in zip(first, cells, strict=True)]
            columns = [16, columns[0] - 16, *columns[1:]]
        style = [
            ("LINEBELOW", (0, 0), (-1, -1), 0.5, _LINE),
            ("VALIGN", (0, 0), (-1, -1), "MIDDLE"),
            ("LEFTPADDING", (0, 0), (-1, -1), 3),
            ("RIGHTPADDING", (0, 0), (-1, -1), 3),
            ("TOPPADDING", (0, 0), (-1, -1), 3),
            ("BOTTOMPADDING", (0, 0), (-1, -1), 4),
        ]
        self._parts.append(Table(cells, columns, repeatRows=bool(head), style=style, spaceBefore=5))

    def picture(self, content: bytes, code: str, note: str = "") -> None:
        """Add a picture (JPEG or PNG), with the QR code of an address beside it."""
        from reportlab.lib.utils import ImageReader
        from reportlab.platypus import Image, Table

        across, high = ImageReader(BytesIO(content)).getSize()
        size = 24 * _MM
        width = self._room * _PICTURE
        shown = Image(BytesIO(content), width, width * high / across)
        side = [_code_flowable(code, size), self._paragraph(note, 7, colour=_QUIET, right=True)]
        style = [
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("LEFTPADDING", (0, 0), (-1, -1), 0),
            ("RIGHTPADDING", (0, 0), (-1, -1), 0),
            ("ALIGN", (1, 0), (1, 0), "RIGHT"),
        ]
        table = Table([[shown, side]], [width, self._room - width], style=style, spaceBefore=4)
        self._parts.append(table)

    def pictures(self, pictures: Sequence[tuple[bytes, str]]) -> None:
        """Add small pictures (JPEG or PNG) in rows of three, each with a line below it."""
        from reportlab.lib.utils import ImageReader
        from reportlab.platypus import Image, Table

        side = self._room / 3
        cells: list[list[Any]] = []
        for content, note in pictures:
            across, high = ImageReader(BytesIO(content)).getSize()
            width = (side - 10) * min(1, across / high)
            shown = Image(BytesIO(content), width, width * high / across)
            cells.append([shown, self._paragraph(note, 8, colour=_QUIET)])
        cells += [[] for _ in range(-len(cells) % 3)]
        rows = [cells[at : at + 3] for at in range(0, len(cells), 3)]
        style = [("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0)]
        self._parts.append(Table(rows, [side] * 3, style=style, spaceBefore=4))

    def pdf(self) -> bytes:
        """Return the document; the same bytes for the same content.

        Raises
        ------
        RequestError : more pages than `numbered.MAX_PAGES`.
        """
        from reportlab.platypus import SimpleDocTemplate  # its frame keeps 6 points to itself

        out = BytesIO()
        document = SimpleDocTemplate(
            out,
            pagesize=self._size,
            leftMargin=_MARGIN - 6,
            rightMargin=_MARGIN - 6,
            topMargin=_MARGIN,
            bottomMargin=_MARGIN + 8,
            invariant=1,
            title=self._letters.text(self._title),
            creator="walltopo",
        )
        if self._lacks and self.missing:
            scripts = ", ".join(scripts_of(self.missing))
            self.text(self._lacks.format(scripts=scripts), quiet=True)
        document.build(self._parts, canvasmaker=numbered_canvas(self._scale, self._draw_foot))
        return out.getvalue()

    def _head(self, title: str, subtitle: str, code: str, note: str) -> None:
        from reportlab.platypus import Table

        words = [self._paragraph(title, 20, bold=True)]
        if subtitle:
            words.append(self._paragraph(subtitle, 11, colour=_QUIET, before=2))
        if not code:
            self._parts += words
            return
        size = 30 * _MM
        side = [_code_flowable(code, size)]
        if note:
            side.append(self._paragraph(note, 7, colour=_QUIET, right=True))
        style = [
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("LEFTPADDING", (0, 0), (-1, -1), 0),
            ("RIGHTPADDING", (0, 0), (-1, -1), 0),
            ("ALIGN", (1, 0), (1, 0), "RIGHT"),
        ]
        columns = [self._room - 1.4 * size, 1.4 * size]
        self._parts.append(Table([[words, side]], columns, style=style))

    def _paragraph(
        self,
        words: str,
        size: float,
        *,
        bold: bool = False,
        colour: str = _INK,
        right: bool = False,
        before: float = 0,
    ) -> Any:
        from reportlab.lib.enums import TA_LEFT, TA_RIGHT
        from reportlab.lib.styles import ParagraphStyle
        from reportlab.platypus import Paragraph

        style = ParagraphStyle(
            f"{size} {bold} {colour} {right} {before}",
            fontName=BOLD if bold else PLAIN,
            fontSize=size,
            leading=size * 1.3,
            textColor=colour,
            spaceBefore=before,
            alignment=TA_RIGHT if right else TA_LEFT,
            splitLongWords=1,
        )
        return Paragraph(escape(self._letters.text(words), quote=False), style)

    def _draw_foot(self, canvas: Any, page: int, pages: int) -> None:
        canvas.setFont(PLAIN, 8)
        canvas.setFillColor(_QUIET)
        number = self._letters.text(self._page.format(page=page, pages=pages))
        room = self._room - self._letters.width(number, 8) - 12
        canvas.drawString(_MARGIN, 10 * _MM, self._letters.cut(self._foot, room, 8))
        canvas.drawRightString(self._size[0] - _MARGIN, 10 * _MM, number)


def _code_flowable(text: str, size: float) -> Any:
    return _make_flowable(size, size, lambda canvas: draw_code(canvas, text, 0, 0, size))


def _draw_spot(colour: str) -> Any:
    """Draw a spot of a colour, with a rim so that white is visible."""

    def draw(canvas: Any) -> None:
        canvas.setFillColor(colour)
        canvas.setStrokeColor(_QUIET)
        canvas.setLineWidth(0.5)
        canvas.circle(5, 5, 4.5, stroke=1, fill=1)

    return _make_flowable(10, 10, draw)


def _make_flowable(width: float, height: float, draw: Callable[[Any], None]) -> Any:
    from reportlab.platypus import Flowable

    class Drawn(Flowable):
        def __init__(self) -> None:
            super().__init__()
            self.width, self.height, self.hAlign = width, height, "RIGHT"

        def draw(self) -> None:
            draw(self.canv)

    return Drawn()
