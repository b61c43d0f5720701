"""Text as the font can print it.

A character without a glyph would be an empty box. It is printed as a question mark and listed in
`PrintableText.missing`, so that the response can name it.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Collection
from functools import cache
from importlib.resources import as_file, files
from typing import Any, Final

PLAIN: Final = "DejaVuSans"
BOLD: Final = "DejaVuSans-Bold"
_INSTEAD: Final = "?"
# Joiners and choosers of a variant: they print nothing by themselves.
_SILENT: Final = frozenset({0x200C, 0x200D, 0x2060, 0xFE0E, 0xFE0F, 0xFEFF})


@cache
def _register_fonts() -> dict[str, Any]:
    """Register both fonts with reportlab."""
    from reportlab.pdfbase.pdfmetrics import registerFont, registerFontFamily
    from reportlab.pdfbase.ttfonts import TTFont

    folder = files("walltopo_gym.paper") / "fonts"
    made = {}
    for name in (PLAIN, BOLD):
        with as_file(folder / f"{name}.ttf") as path:
            made[name] = TTFont(name, str(path))
        registerFont(made[name])
    registerFontFamily(PLAIN, normal=PLAIN, bold=BOLD, italic=PLAIN, boldItalic=BOLD)
    return made


def scripts_of(characters: Collection[str]) -> list[str]:
    """Return the scripts of letters by their names in Unicode, and "symbols" for all others."""
    names = {
        unicodedata.name(one, "symbols").partition(" ")[0].partition("-")[0].capitalize()
        if unicodedata.category(one)[0] in "LM"
        else "symbols"
        for one in characters
    }
    return sorted(names)


class PrintableText:
    """The text of one document; `missing` has the characters that the font lacks."""

    def __init__(self) -> None:
        self._glyphs = _register_fonts()[PLAIN].face.charToGlyph
        self.missing: set[str] = set()

    def text(self, words: str) -> str:
        """Return text as one printable line, with combining marks composed."""
        made = []
        for character in unicodedata.normalize("NFC", words):
            code = ord(character)
            if code in _SILENT:
                continue
            if character.isspace():
                character = " "
            elif code not in self._glyphs:
                self.missing.add(character)
                character = _INSTEAD
            made.append(character)
        return "".join(made)

    def width(self, words: str, size: float, *, bold: bool = False) -> float:
        """Return the width in points of text from `text`."""
        width: float = _register_fonts()[BOLD if bold else PLAIN].stringWidth(words, size)
        return width

    def cut(self, words: str, room: float, size: float, *, bold: bool = False) -> str:
        """Return one line of at most `room` points, shortened by an ellipsis."""
        words = self.text(words)
        if self.width(words, size, bold=bold) <= room:
            return words
        while words and self.width(words.rstrip() + "…", size, bold=bold) > room:
            words = words[:-1]
        return words.rstrip() + "…"

    def lines(
        self, words: str, room: float, size: float, most: int, *, bold: bool = False
    ) -> list[str]:
        """Return at most `most` lines of `room` points; the last one is shortened."""
        left, made = self.text(words).split(), list[str]()
        while left:
            if len(made) == most - 1:
                return [*made, self.cut(" ".join(left), room, size, bold=bold)]
            line = left.pop(0)
            while left and self.width(f"{line} {left[0]}", size, bold=bold) <= room:
                line += " " + left.pop(0)
            keep = len(line)
            while keep > 1 and self.width(line[:keep], size, bold=bold) > room:
                keep -= 1  # a word that is longer than the line is broken
            if keep < len(line):
                left.insert(0, line[keep:])
            made.append(line[:keep])
        return made
