"""`photos/`: the upright JPEGs that every stage after ingest reads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from walltopo.core import InputError
from walltopo.core.files import move_into_place

__all__ = ["PhotoSet"]


@dataclass(frozen=True)
class PhotoSet:
    """A folder of photos, read one at a time."""

    folder: Path

    @classmethod
    def load(cls, path: Path) -> PhotoSet:
        """The folder; InputError where it is missing."""
        if not path.is_dir():
            raise InputError(f"{path}: no such folder of photos")
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    def path(self, name: str) -> Path:
        """The file of a photo.

        Raises
        ------
        InputError : it is missing.
        """
        path = self.folder / name
        if not path.is_file():
            raise InputError(f"{path}: the photo is missing")
        return path
