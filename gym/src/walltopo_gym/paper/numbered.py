"""A canvas that numbers its pages once their total is known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from walltopo_gym.errors import RequestError

MAX_PAGES: Final = 400


def numbered_canvas(scale: float, foot: Callable[[Any, int, int], None]) -> Callable[..., Any]:
    """Return the canvas class of a document.

    Parameters
    ----------
    scale : of the finished page; everything is drawn for a page of scale 1.
    foot : receives the canvas, the page number and the number of pages.

    Raises
    ------
    RequestError : there are more than `MAX_PAGES` pages.
    """
    from reportlab.pdfgen.canvas import Canvas

    class Numbered(Canvas):
        def __init__(self, *words: Any, **named: Any) -> None:
            super().__init__(*words, **named)
            self._kept: list[dict[str, Any]] = []

        def showPage(self) -> None:  # noqa: N802 (reportlab's name)
            if len(self._kept) >= MAX_PAGES:
                raise RequestError("pages-too-many", "pages-choose-less", most=MAX_PAGES)
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
