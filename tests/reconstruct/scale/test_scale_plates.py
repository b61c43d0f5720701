"""Plate geometry, its TOML, and the printed sheet."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.markers import STICKER_SIDE, STICKERS, detect_markers
from walltopo.reconstruct.scale.plate_pdf import PAPERS, Text, draw_plate, draw_stickers, to_pdf
from walltopo.reconstruct.scale.plates import BUILT_IN, Plate, built_in_plates, read_plates


def first(name: str) -> Plate:
    return next(plate for plate in built_in_plates() if plate.name == name)


def rasterise(pdf: bytes, paper: tuple[float, float]) -> NDArray[np.uint8]:
    """The rectangles that the page's content stream fills, at 6 pixels a millimetre."""
    scale = 6000
    points = scale * 0.0254 / 72  # pixels per PDF unit
    height, width = round(paper[1] * scale), round(paper[0] * scale)
    image = np.full((height, width), 255, np.uint8)
    content = pdf[pdf.index(b"stream\n") + 7 : pdf.index(b"\nendstream")]
    for found in re.finditer(rb"^(\S+) g (\S+) (\S+) (\S+) (\S+) re f$", content, re.MULTILINE):
        grey, x, y, across, up = (float(value) for value in found.groups())
        x0, x1 = round(x * points), round((x + across) * points)
        y0, y1 = round(y * points), round((y + up) * points)
        image[height - y1 : height - y0, x0:x1] = round(255 * grey)
    return image


def test_the_board_is_as_described() -> None:
    plate = first("board")
    assert plate.ids == (0, 1, 2, 3)
    assert np.allclose(plate.corners(0)[0], [-0.19, 0.19, 0])  # top left of the top left marker
    assert np.allclose(plate.corners(2)[2], [0.19, -0.19, 0])  # bottom right of the bottom right
    assert np.allclose(plate.corners(1)[0] - plate.corners(0)[0], [0.23, 0, 0])
    assert np.allclose(plate.outline[[0, 2]], [[-0.21, 0.21, 0], [0.21, -0.21, 0]])


def test_no_two_built_in_plates_share_an_id() -> None:
    ids = [marker for plate in built_in_plates() for marker in plate.ids]
    assert len(ids) == len(set(ids))
    assert max(ids) < 50


def test_the_built_in_toml_is_readable_as_a_file(tmp_path: Path) -> None:
    (tmp_path / "plates.toml").write_text(BUILT_IN, encoding="utf-8")
    assert read_plates(tmp_path / "plates.toml") == built_in_plates()


@pytest.mark.parametrize(
    ("text", "output"),
    [
        ("plate = 3", "$.plate"),
        ("[[plate]]\nids = [0, 1, 2, 3]\nsize = [1, 1]\nmarker = 0.1", "`margin`"),
        ("[[plate]]\nids = [0]\nsize = [1, 1]\nmarker = 0.1\nmargin = 0", "length 4"),
        (
            "[[plate]]\nids = [0, 1, 2, 3]\nsize = [1, 1]\nmarker = 0.1\nmargins = 0",
            "`margins`",
        ),
        (
            "[[plate]]\nids = [0, 1, 2, 3]\nsize = [0.2, 0.2]\nmarker = 0.15\nmargin = 0.02",
            "do not fit",
        ),
        (
            "[[plate]]\nids = [0, 1, 2, 2]\nsize = [1, 1]\nmarker = 0.1\nmargin = 0.02",
            "marker 2 is on both",
        ),
        ("[[plate", "not valid TOML"),
        (
            "[[plate]]\nids = [0, 1, 2, 3]\nsize = [420, 420]\nmarker = 150\nmargin = 20",
            "<= 100.0 - at `$.plate[0].size[0]`",  # millimetres
        ),
        ("[[plate]]\nids = [0, 1, 2, 3]\nsize = [1, 1]\nmarker = nan\nmargin = 0", "marker"),
        (
            "[[plate]]\nids = [0, 1, 2, 3]\nsize = [1, 1]\nmarker = 0.1\nmargin = 0\n"
            "copies = 999999",
            "copies",
        ),
    ],
)
def test_a_wrong_file_is_distinguished(tmp_path: Path, text: str, output: str) -> None:
    (tmp_path / "plates.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(output)):
        read_plates(tmp_path / "plates.toml")


@pytest.mark.parametrize("name", ["a4", "a3", "letter"])
def test_the_printed_sheet_has_its_markers_where_the_geometry_says(name: str) -> None:
    plate, paper = first(name), PAPERS[name]
    image = rasterise(to_pdf([draw_plate(plate, paper)], paper, name), paper)
    found = detect_markers(image, "sheet", [plate.dictionary])
    assert sorted(d.marker for d in found) == sorted(plate.ids)
    for detection in found:
        metres = detection.corners / 6000 - np.array(paper) / 2
        metres[:, 1] *= -1
        assert np.abs(metres - plate.corners(detection.marker)[:, :2]).max() < 0.0002


def test_the_pdf_is_well_formed_and_of_true_size() -> None:
    plate, paper = first("a4"), PAPERS["a4"]
    pdf = to_pdf([draw_plate(plate, paper)], paper, "plate (a4)")
    places = [int(m.group(1)) for m in re.finditer(rb"(\d{10}) 00000 n", pdf)]
    assert [pdf[p : p + 7] for p in places] == [b"%d 0 obj" % k for k in range(1, 7)]
    table = int(re.search(rb"startxref\n(\d+)", pdf).group(1))  # type: ignore[union-attr]
    assert pdf[table : table + 4] == b"xref"
    assert b"/MediaBox [0 0 841.8898 595.2756]" in pdf
    assert b"/Title (plate \\(a4\\))" in pdf


def test_words_and_ruler_stay_clear_of_the_markers() -> None:
    for name, paper in PAPERS.items():
        plate = first(name)
        rim = plate.marker / 6
        inner = plate.size[0] / 2 - plate.margin - plate.marker - rim + 1e-9
        for shape in draw_plate(plate, paper):
            if isinstance(shape, Text) and shape.text:
                assert abs(shape.x - paper[0] / 2) <= inner
                assert shape.x + 0.52 * shape.size * len(shape.text) <= paper[0] / 2 + inner
                assert 0.01 < shape.y < paper[1] - 0.01


def test_a_plate_larger_than_the_paper_is_refused() -> None:
    with pytest.raises(InputError, match="does not fit on paper"):
        draw_plate(first("a3"), PAPERS["a4"])


@pytest.mark.parametrize(("name", "count"), [("a4", 6), ("a3", 12), ("letter", 4)])
def test_sheets_of_stickers_carry_each_code_once_at_true_size(name: str, count: int) -> None:
    paper = PAPERS[name]
    sheets = draw_stickers(range(100, 100 + 2 * count), paper)
    assert len(sheets) == 2
    image = rasterise(to_pdf(sheets, paper, "stickers"), paper)  # the first page
    found = detect_markers(image, "sheet", [STICKERS])
    assert sorted(d.marker for d in found) == list(range(100, 100 + count))
    for detection in found:
        sides = np.linalg.norm(np.diff(detection.corners, axis=0), axis=1) / 6000
        assert np.abs(sides - STICKER_SIDE).max() < 0.0002
    for shape in (shape for sheet in sheets for shape in sheet):
        assert 0 < shape.x < paper[0]
        assert 0 < shape.y < paper[1]
