"""Finished files that no later stage reads: handed on from where a stage made them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from walltopo.core.files import move_into_place

__all__ = ["Made"]


@dataclass(frozen=True)
class Made:
    """A file or a folder; moved to its place when it is stored."""

    path: Path

    def save(self, path: Path) -> None:
        """Move it to `path`, atomically."""
        move_into_place(self.path, path)
