"""A canvas that numbers its pages when it knows how many they are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from walltopo.core import InputError

MOST_PAGES: Final = 400


def numbered(scale: float, foot: Callable[[Any, int, int], None]) -> Callable[..., Any]:
    """What makes the canvas of a document.

    Parameters
    ----------
    scale : of the finished page; all is drawn for a page of scale 1.
    foot : is given the canvas, the number of the page, and of how many.

    Raises
    ------
    InputError : when there are more than `MOST_PAGES` pages.
    """
    from reportlab.pdfgen.canvas import Canvas

    class Numbered(Canvas):
        def __init__(self, *words: Any, **named: Any) -> None:
            super().__init__(*words, **named)
            self._kept: list[dict[str, Any]] = []

        def showPage(self) -> None:  # noqa: N802 (reportlab's name)
            if len(self._kept) >= MOST_PAGES:
                raise InputError(f"more than {MOST_PAGES} pages", "Choose less of it.")
            self._kept.append(dict(self.__dict__))
            self._startPage()

        def save(self) -> None:
            pages = len(self._kept)
            for number, page in enumerate(self._kept, 1):
                self.__dict__.update(page)
                self._code.insert(0, f"{scale:.5f} 0 0 {scale:.5f} 0 0 cm")
                foot(self, number, pages)
                self.setPageSize([side * scale for side in self._pagesize])
                super().showPage()
            super().save()

    return Numbered
