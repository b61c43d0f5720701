"""A plate as a printable PDF: vector shapes, true size, with a ruler to check the print."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.reconstruct.scale.plates import Plate, marker_cells

PAPERS = {"a4": (0.297, 0.210), "a3": (0.420, 0.297)}  # landscape, metres

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
    """A line of text that begins at (x, y), baseline, metres; `size` is the font's, metres."""

    x: float
    y: float
    size: float
    words: str


def draw_plate(plate: Plate, paper: tuple[float, float]) -> list[Rectangle | Text]:
    """What is on the sheet: four markers, their dimensions, a ruler, and which edge is the top.

    Parameters
    ----------
    plate : its size must fit the paper.
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
    shapes: list[Rectangle | Text] = []
    for marker in plate.ids:
        x, y, _ = plate.corners(marker)[3]  # bottom left
        shapes += _marker(plate, marker, middle[0] + x, middle[1] + y)
    return [*shapes, *_words(plate, paper)]


def _marker(plate: Plate, marker: int, x: float, y: float) -> Iterable[Rectangle]:
    """A black square with its white cells, each as part of a row and of a column.

    Cells are joined to runs along both directions, so that no viewer shows hairlines between
    neighbours.
    """
    white = marker_cells(plate.dictionary, marker)
    cell = plate.marker / len(white)
    yield Rectangle(x, y, plate.marker, plate.marker, 0.0)
    for row, first, count in _runs(white):
        top = len(white) - 1 - row
        yield Rectangle(x + first * cell, y + top * cell, count * cell, cell, 1.0)
    for column, first, count in _runs(white.T):
        low = len(white) - first - count
        yield Rectangle(x + column * cell, y + low * cell, cell, count * cell, 1.0)


def _runs(cells: NDArray[np.bool_]) -> Iterable[tuple[int, int, int]]:
    """(row, first, count) of each run of set cells."""
    for row, line in enumerate(cells):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(int), [0]])))
        for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            yield row, first, after - first


def _words(plate: Plate, paper: tuple[float, float]) -> list[Rectangle | Text]:
    """The middle column, clear of the white rims that the markers need."""
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
    shapes: list[Rectangle | Text] = [
        Text(x, top - plate.margin - (k + 1.2) * 1.5 * size, size, words)
        for k, words in enumerate(lines)
    ]
    return shapes + _ruler((paper[0] - ruler) / 2, paper[1] / 2 - plate.size[1] * 0.36, ruler, size)


def _ruler(x: float, y: float, length: float, size: float) -> list[Rectangle | Text]:
    thin = 0.0002
    shapes: list[Rectangle | Text] = [Rectangle(x, y, length, thin, 0.0)]
    for millimetre in range(round(1000 * length) + 1):
        tall = 0.006 if millimetre % 10 == 0 else 0.004 if millimetre % 5 == 0 else 0.0025
        shapes.append(Rectangle(x + millimetre / 1000 - thin / 2, y, thin, tall, 0.0))
    words = f"from first to last line: {_mm(length)} mm"
    shapes.append(Text(x, y - 1.3 * size, size, words))
    return shapes


def to_pdf(shapes: Iterable[Rectangle | Text], paper: tuple[float, float], title: str) -> bytes:
    """One page with the shapes at true size (PDF 1.4, Helvetica, no images).

    Parameters
    ----------
    paper : width and height, metres.
    title : shown by viewers; ASCII.
    """
    content = "\n".join(_operators(shape) for shape in shapes).encode("latin-1", "replace")
    width, height = (f"{side * _POINTS:.4f}" for side in paper)
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] /Contents 4 0 R "
        "/Resources << /Font << /F1 5 0 R >> >> >>".encode(),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        f"<< /Title ({_escaped(title)}) /Producer (walltopo) >>".encode("ascii", "replace"),
    ]
    body = b"%PDF-1.4\n"
    places = []
    for number, text in enumerate(objects, start=1):
        places.append(len(body))
        body += b"%d 0 obj\n%s\nendobj\n" % (number, text)
    table = b"".join(b"%010d 00000 n \n" % place for place in places)
    return (
        body
        + b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
        + table
        + b"trailer\n<< /Size %d /Root 1 0 R /Info 6 0 R >>\n" % (len(objects) + 1)
        + b"startxref\n%d\n%%%%EOF\n" % len(body)
    )


def _operators(shape: Rectangle | Text) -> str:
    x, y = shape.x * _POINTS, shape.y * _POINTS
    if isinstance(shape, Rectangle):
        width, height = shape.width * _POINTS, shape.height * _POINTS
        return f"{shape.grey:g} g {x:.4f} {y:.4f} {width:.4f} {height:.4f} re f"
    size = shape.size * _POINTS
    return f"0 g BT /F1 {size:.3f} Tf {x:.4f} {y:.4f} Td ({_escaped(shape.words)}) Tj ET"


def _escaped(words: str) -> str:
    return words.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")


def _mm(metres: float) -> str:
    return f"{1000 * metres:g}"
