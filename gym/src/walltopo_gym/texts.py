"""One form for texts that look the same, and one key for texts that mean the same.

Spreadsheets, web pages and keyboards send spaces that do not break, double or trailing spaces,
characters without width, and letters apart from their accents. None of them can be seen.
"""

from __future__ import annotations

import re
import unicodedata
from typing import Final

# Zero-width space, word joiner and its kin, soft hyphen, byte order mark: nothing is drawn.
_UNSEEN: Final = re.compile("[\u00ad\u200b\u2060-\u2064\ufeff]")
# Between letters the joiners choose a letter's form (Persian, emoji); elsewhere they do nothing.
_JOINERS: Final = re.compile("[\u200c\u200d]")
_EDGE_JOINERS: Final = re.compile("^[\u200c\u200d]+|[\u200c\u200d]+$|(?<=\\s)[\u200c\u200d]+")


# A set of a regular expression: control characters, line breaks, and what turns the direction.
UNPRINTABLE: Final = r"\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069"
_UNPRINTABLE: Final = re.compile(rf"[{UNPRINTABLE}\ud800-\udfff]+")


def printable(text: str) -> str:
    """Return a stranger's text as one printable line: no control or direction characters."""
    return one_line(blank_unprintable(text))


def blank_unprintable(text: str) -> str:
    """Return a text with a space for each run of control and direction characters."""
    return _UNPRINTABLE.sub(" ", text)


def one_line(text: str) -> str:
    """Return a text in Unicode's form NFC, with single plain spaces and without unseen characters.

    Tabs and line breaks count as spaces.
    """
    plain = _UNSEEN.sub("", unicodedata.normalize("NFC", text))
    return " ".join(_EDGE_JOINERS.sub("", " ".join(plain.split())).split())


def same_key(text: str) -> str:
    """Return the same text for texts that differ in case, spaces or unseen characters alone."""
    return unicodedata.normalize("NFC", _JOINERS.sub("", one_line(text)).casefold())
