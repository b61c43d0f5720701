"""`cutouts/`: masked crops of each hold, and their index."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec

from walltopo.core.files import move_into_place
from walltopo.core.inside import check_name
from walltopo.scans.bounds import Count, FileName, Label
from walltopo.scans.document import Document

__all__ = ["INDEX", "Cutout", "CutoutIndex", "Cutouts"]

INDEX = "index.json"


class Cutout(msgspec.Struct, frozen=True):
    """One picture of a hold.

    Parameters
    ----------
    id : of the hold; file : in `cutouts/`; photo : it was cut from.
    pixels : visible pixels of the hold; sharpness : variance of the Laplacian.
    cut : the hold touches the photo's border.
    """

    id: Label
    file: FileName
    photo: str
    pixels: Count
    sharpness: float
    cut: bool

    def __post_init__(self) -> None:
        check_name(self.file)


class CutoutIndex(Document, frozen=True, kw_only=True):
    """`cutouts/index.json`: the best picture of each hold first."""

    cutouts: tuple[Cutout, ...]


@dataclass(frozen=True)
class Cutouts:
    """A folder of cutouts with its index."""

    folder: Path
    index: tuple[Cutout, ...]

    @classmethod
    def load(cls, path: Path) -> Cutouts:
        """Read the index; InputError where it is missing or broken."""
        return cls(path, CutoutIndex.load(path / INDEX).cutouts)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    def best(self) -> dict[int, Path]:
        """Hold id to the file of its best cutout."""
        found: dict[int, Path] = {}
        for entry in self.index:
            found.setdefault(entry.id, self.folder / entry.file)
        return found
