"""How a stage tells the outside how far it is, without knowing who listens."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Receiver of a stage's progress; the CLI draws it, a library caller may ignore it."""

    def step(self, what: str, total: int | None = None) -> None:
        """Begin a new sub-step of the stage, of `total` items where that is known."""

    def advance(self, count: int = 1) -> None:
        """`count` more items of the current step are done."""

    def note(self, message: str) -> None:
        """Tell something worth a line (a photo skipped, a fallback chosen by a setting)."""

    def detail(self, message: str) -> None:
        """Tell something that only `-v` shows."""


class Silent:
    """The receiver that says nothing."""

    def step(self, what: str, total: int | None = None) -> None: ...
    def advance(self, count: int = 1) -> None: ...
    def note(self, message: str) -> None: ...
    def detail(self, message: str) -> None: ...
