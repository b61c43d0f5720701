"""Define the interface for a stage's progress."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Receives a stage's progress; the command line displays it, library callers may ignore it."""

    def step(self, what: str, total: int | None = None) -> None:
        """Start a new step of the stage, with `total` items if known."""

    def advance(self, count: int = 1) -> None:
        """Report `count` more finished items of the current step."""

    def note(self, message: str) -> None:
        """Report an event for the user (a skipped photo, a fallback chosen by a setting)."""

    def detail(self, message: str) -> None:
        """Report an event that is shown with `-v` only."""


class Silent:
    """A `Progress` that ignores everything."""

    def step(self, what: str, total: int | None = None) -> None: ...
    def advance(self, count: int = 1) -> None: ...
    def note(self, message: str) -> None: ...
    def detail(self, message: str) -> None: ...
