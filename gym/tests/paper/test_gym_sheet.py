"""Pages: each letter is printed or reported, lines keep within their room, codes can be read."""

from __future__ import annotations

import pytest
from gym.tests.printed import codes_of, pages_of, words_of
from hypothesis import given
from hypothesis import strategies as st

from walltopo_gym.errors import RequestError
from walltopo_gym.paper import numbered
from walltopo_gym.paper.printable import PrintableText
from walltopo_gym.paper.sheet import SIZES, Paper, Sheet

ADDRESS = "https://walls.example.com/r/0123456789"


def results(rows: int) -> Sheet:
    made = Sheet("Jarní pohár", "Straße – Žižkov", foot="Halle", code=ADDRESS, code_note="short")
    made.heading("Women")
    made.table(
        ["#", "Name"],
        [[str(row), f"Příliš <žluťoučký> & {row}"] for row in range(rows)],
        widths=[1, 9],
        right={0},
        bold={1},
    )
    return made


def test_what_is_written_can_be_read() -> None:
    content = results(90).pdf()
    words = words_of(content)
    for text in ("Jarní pohár", "Straße – Žižkov", "Příliš <žluťoučký> & 89", "2 / 3", "Halle"):
        assert text in words
    assert words.count("Name") == len(pages_of(content)) == 3  # the head of the table on each page
    assert codes_of(pages_of(content)[0]) == {ADDRESS}


def test_the_same_words_are_the_same_bytes() -> None:
    assert results(3).pdf() == results(3).pdf()


def test_missing_glyphs_are_reported() -> None:
    made = Sheet("Moon 漢字 Ωμέγα Жук")
    assert "Moon ?? Ωμέγα Жук" in words_of(made.pdf())
    assert made.missing == {"漢", "字"}


def test_pages_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbered, "MAX_PAGES", 2)
    with pytest.raises(RequestError, match="pages"):
        results(90).pdf()


@given(st.text(max_size=60), st.floats(40, 300), st.integers(1, 4), st.booleans())
def test_lines_keep_within_their_room(words: str, room: float, most: int, bold: bool) -> None:
    letters = PrintableText()
    lines = letters.lines(words, room, 10, most, bold=bold)
    assert len(lines) <= most
    assert all(letters.width(line, 10, bold=bold) <= room for line in lines)
    if not any(line.endswith("…") for line in lines):
        printed = "".join(letters.text(words).split())
        assert "".join("".join(lines).split()) == printed


@given(st.text(max_size=60))
def test_each_character_is_printed_or_reported(words: str) -> None:
    letters = PrintableText()
    printed = letters.text(words)
    assert letters.missing.isdisjoint(printed)
    assert letters.text(printed) == printed


def test_a_page_says_which_scripts_its_font_lacks() -> None:
    sheet = Sheet("Results", lacks="not printed: {scripts}")
    sheet.text("אנה 花子 Žofie 🧗")
    assert sheet.missing
    lines = "".join(words_of(sheet.pdf()).split())
    assert "notprinted:Cjk,Hebrew,symbols" in lines
    plain = Sheet("Results", lacks="not printed: {scripts}")
    plain.text("Žofie")
    assert "not printed" not in words_of(plain.pdf())


@pytest.mark.parametrize("size", ["letter", "tabloid", "a4"])
def test_a_page_has_the_size_of_its_paper(size: Paper) -> None:
    sheet = Sheet("Results", size=size)
    width, height = pages_of(sheet.pdf())[0].get_size()
    assert (round(width * 25.4 / 72), round(height * 25.4 / 72)) == SIZES[size]
