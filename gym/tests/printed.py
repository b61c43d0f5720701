"""Pages of PDF as a reader has them: their words, and what a phone reads of their QR codes."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pypdfium2

_SCALE = 3


def pages_of(content: bytes) -> list[Any]:
    """The pages of a document."""
    return list(pypdfium2.PdfDocument(content))


def words_of(content: bytes) -> str:
    """All that stands on the pages."""
    return "\n".join(page.get_textpage().get_text_range() for page in pages_of(content))


def codes_of(page: Any, across: int = 1, down: int = 1) -> set[str]:
    """Return the codes that a phone reads from a page of `across` x `down` parts, one code each."""
    picture = np.asarray(page.render(scale=_SCALE).to_pil().convert("RGB"))
    found = set()
    for band in np.array_split(picture, down, axis=0):
        for part in np.array_split(band, across, axis=1):
            text, _, _ = cv2.QRCodeDetectorAruco().detectAndDecode(np.ascontiguousarray(part))
            found.add(text)
    return found - {""}
