"""Draw scale plates and stickers as printable PDFs: vector shapes, true size, with a ruler."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.markers import marker_cells
from walltopo.reconstruct.scale.plates import Plate, sticker

# Landscape, metres.
PAPERS = {"a4": (0.297, 0.210), "a3": (0.420, 0.297), "letter": (0.2794, 0.2159)}

_THIN = 0.0002  # m; width of a line
_POINTS = 72 / 0.0254  # PDF units per metre


@dataclass(frozen=True)
class Rectangle:
    """A filled rectangle; metres from the bottom left of the paper; grey 0 black to 1 white."""

    x: float
    y: float
    width: float
    height: float
    grey: float


@dataclass(frozen=True)
class Text:
    """A line of text whose baseline starts at (x, y), metres; `size` is the font size, metres."""

    x: float
    y: float
    size: float
    text: str


Shape = Rectangle | Text


def draw_plate(plate: Plate, paper: tuple[float, float]) -> list[Shape]:
    """Draw the sheet: four markers, their dimensions, a ruler and an arrow to the top edge.

    Parameters
    ----------
    plate : plate no larger than the paper.
    paper : width and height in metres.

    Raises
    ------
    InputError : the plate is larger than the paper.
    """
    left, bottom = (paper[0] - plate.size[0]) / 2, (paper[1] - plate.size[1]) / 2
    if min(left, bottom) < -1e-9:
        raise InputError(
            f"plate {plate.label} is {_mm(plate.size[0])} x {_mm(plate.size[1])} mm and does not "
            f"fit on paper of {_mm(paper[0])} x {_mm(paper[1])} mm"
        )
    middle = (paper[0] / 2, paper[1] / 2)
    shapes: list[Shape] = []
    for marker in plate.ids:
        x, y, _ = plate.corners(marker)[3]  # bottom left
        shapes += _marker_shapes(plate, marker, middle[0] + x, middle[1] + y)
    return [*shapes, *_draw_labels(plate, paper)]


def _marker_shapes(plate: Plate, marker: int, x: float, y: float) -> Iterable[Rectangle]:
    """Yield a black square with its white cells, each as part of a row and of a column.

    Cells are merged into runs in both directions, because viewers show hairlines between adjacent
    rectangles.
    """
    white = marker_cells(plate.dictionary, marker)
    cell = plate.marker / len(white)
    yield Rectangle(x, y, plate.marker, plate.marker, 0.0)
    for row, first, count in _set_runs(white):
        top = len(white) - 1 - row
        yield Rectangle(x + first * cell, y + top * cell, count * cell, cell, 1.0)
    for column, first, count in _set_runs(white.T):
        low = len(white) - first - count
        yield Rectangle(x + column * cell, y + low * cell, cell, count * cell, 1.0)


def _set_runs(cells: NDArray[np.bool_]) -> Iterable[tuple[int, int, int]]:
    """Yield (row, first, count) of each run of set cells."""
    for row, line in enumerate(cells):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(int), [0]])))
        for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            yield row, first, after - first


def _draw_labels(plate: Plate, paper: tuple[float, float]) -> list[Shape]:
    """Draw the middle column, clear of the white margins that the markers need."""
    cell = plate.marker / 6
    inner = plate.size[0] - 2 * (plate.margin + plate.marker + cell)
    ruler = max(0.02, 0.02 * int(inner / 0.02))
    size = min(0.0045, inner / 27)
    outer = [side - 2 * plate.margin for side in plate.size]
    x, top = (paper[0] - inner) / 2, (paper[1] + plate.size[1]) / 2
    lines = [
        "^  top edge: the x axis of the scan runs",
        "    along it, to the right",
        "",
        f"walltopo measure: {plate.label}",
        f"{plate.dictionary}, ids {', '.join(map(str, plate.ids))}",
        f"side of a marker: {_mm(plate.marker)} mm",
        "outer edges of the four markers:",
        f"    {_mm(outer[0])} x {_mm(outer[1])} mm",
        "",
        "Print at 100 %, not fitted to the page.",
        "Check with a ruler. Glue onto a stiff flat",
        "board. Lay it on the floor, print up.",
    ]
    shapes: list[Shape] = [
        Text(x, top - plate.margin - (k + 1.2) * 1.5 * size, size, text)
        for k, text in enumerate(lines)
    ]
    return shapes + _draw_ruler(
        (paper[0] - ruler) / 2, paper[1] / 2 - plate.size[1] * 0.36, ruler, size
    )


def _draw_ruler(x: float, y: float, length: float, size: float) -> list[Shape]:
    """Draw a ruler with millimetre marks and its length as text."""
    shapes: list[Shape] = [Rectangle(x, y, length, _THIN, 0.0)]
    for millimetre in range(round(1000 * length) + 1):
        tall = 0.006 if millimetre % 10 == 0 else 0.004 if millimetre % 5 == 0 else 0.0025
        shapes.append(Rectangle(x + millimetre / 1000 - _THIN / 2, y, _THIN, tall, 0.0))
    text = f"from first to last line: {_mm(length)} mm"
    shapes.append(Text(x, y - 1.3 * size, size, text))
    return shapes


_TEXT = 0.0035  # m; size of the letters on a sheet of stickers


def draw_stickers(codes: Sequence[int], paper: tuple[float, float]) -> list[list[Shape]]:
    """Draw sheets of stickers with cutting marks; each carries its code in small print.

    Parameters
    ----------
    codes : codes of the stickers, 0 to 586.
    paper : width and height in metres.

    Returns
    -------
    The shapes of each sheet.
    """
    side = sticker(0).size[0]
    columns, rows = int(paper[0] / side), int((paper[1] - 2 * _TEXT) / side)
    sheets = [codes[k : k + columns * rows] for k in range(0, len(codes), columns * rows)]
    left, bottom = (paper[0] - columns * side) / 2, (paper[1] - rows * side - 2 * _TEXT) / 2
    return [_draw_sticker_sheet(sheet, (left, bottom), (columns, rows), side) for sheet in sheets]


def _draw_sticker_sheet(
    codes: Sequence[int], start: tuple[float, float], counts: tuple[int, int], side: float
) -> list[Shape]:
    """Draw one sheet of stickers from the top left; `start` is its bottom left corner, metres."""
    columns, rows = counts
    top = start[1] + rows * side
    shapes: list[Shape] = [
        Text(
            start[0] + 0.01,
            top + _TEXT / 2,
            _TEXT,
            "Print at 100 %. Cut. Stick flat onto bare panels, each code once per wall.",
        ),
    ]
    for place, code in enumerate(codes):
        x, y = start[0] + place % columns * side, top - (place // columns + 1) * side
        plate = sticker(code)
        shapes += _marker_shapes(plate, code, x + plate.margin, y + plate.margin)
        shapes.append(
            Text(x + plate.margin, y + 0.0025, 0.0025, f"{code}   {_mm(plate.marker)} mm")
        )
    for k in range(columns + 1):
        for m in range(rows + 1):
            x, y = start[0] + k * side, start[1] + m * side
            shapes.append(Rectangle(x - 0.002, y - _THIN / 2, 0.004, _THIN, 0.6))
            shapes.append(Rectangle(x - _THIN / 2, y - 0.002, _THIN, 0.004, 0.6))
    return shapes


def to_pdf(pages: Sequence[Iterable[Shape]], paper: tuple[float, float], title: str) -> bytes:
    """Return a PDF with the shapes of each page at true size (PDF 1.4, Helvetica, no images).

    Parameters
    ----------
    paper : width and height, metres.
    title : shown by viewers; ASCII.
    """
    width, height = (f"{side * _POINTS:.4f}" for side in paper)
    numbers = [5 + 2 * k for k in range(len(pages))]
    kids = " ".join(f"{number} 0 R" for number in numbers)
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(pages)} >>".encode(),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        f"<< /Title ({_escaped(title)}) /Producer (walltopo) >>".encode("ascii", "replace"),
    ]
    for number, shapes in zip(numbers, pages, strict=True):
        content = "\n".join(_operators(shape) for shape in shapes).encode("latin-1", "replace")
        objects += [
            f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] "
            f"/Contents {number + 1} 0 R /Resources << /Font << /F1 3 0 R >> >> >>".encode(),
            b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        ]
    body = b"%PDF-1.4\n"
    offsets = []
    for number, text in enumerate(objects, start=1):
        offsets.append(len(body))
        body += b"%d 0 obj\n%s\nendobj\n" % (number, text)
    table = b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
    return (
        body
        + b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
        + table
        + b"trailer\n<< /Size %d /Root 1 0 R /Info 4 0 R >>\n" % (len(objects) + 1)
        + b"startxref\n%d\n%%%%EOF\n" % len(body)
    )


def _operators(shape: Shape) -> str:
    x, y = shape.x * _POINTS, shape.y * _POINTS
    if isinstance(shape, Rectangle):
        width, height = shape.width * _POINTS, shape.height * _POINTS
        return f"{shape.grey:g} g {x:.4f} {y:.4f} {width:.4f} {height:.4f} re f"
    size = shape.size * _POINTS
    return f"0 g BT /F1 {size:.3f} Tf {x:.4f} {y:.4f} Td ({_escaped(shape.text)}) Tj ET"


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")


def _mm(metres: float) -> str:
    return f"{1000 * metres:g}"
