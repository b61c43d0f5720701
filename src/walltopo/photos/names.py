"""File names for the stored photos: the source's own, made safe and unique."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

__all__ = ["Names"]

# File systems take 255 bytes; what stages and other programs add to a name needs some of them.
_MOST_BYTES: Final = 180


class Names:
    """Gives each name once, whatever the case of its letters."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def give(self, stem: str, end: str = "") -> str:
        """A name for a photo of this stem; `end` stays whole where the stem is cut."""
        stem = unicodedata.normalize("NFC", stem)
        # Bytes that were no UTF-8 stand as lone surrogates: no letters, so they become "_" too.
        stem = re.sub(r"[^\w.-]+", "_", stem).strip("._") or "photo"
        stem = stem.encode()[:_MOST_BYTES].decode("utf-8", "ignore") + end
        name, number = f"{stem}.jpg", 2
        while name.lower() in self._taken:
            name, number = f"{stem}_{number}.jpg", number + 1
        self._taken.add(name.lower())
        return name
