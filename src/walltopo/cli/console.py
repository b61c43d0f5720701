"""The one place that writes to the terminal."""

from __future__ import annotations

from rich.console import Console

__all__ = ["console", "error_console"]

console = Console(highlight=False)
error_console = Console(stderr=True, highlight=False)
