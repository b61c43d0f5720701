"""The result of a reader of poses, and the lookup of the user's photos by name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from walltopo.core import InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.core.files import as_text
from walltopo.geometry.similarity import Similarity
from walltopo.images.files import open_picture

Point = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Export:
    """The poses of one export.

    Parameters
    ----------
    views : posed photos by the names in the export, which may lack a suffix; frame of the export.
    metric : whether the unit is a metre.
    up : unit vector in the frame of the export, if the app measured gravity.
    mesh_frame : from the frame of the poses to that of the export's own mesh, if they differ.
    """

    views: list[View]
    metric: bool = False
    up: Point | None = None
    mesh_frame: Similarity | None = None


@dataclass(frozen=True)
class PhotoFiles:
    """The user's photos, found by the names that programs write.

    Parameters
    ----------
    files : photos of the scan.
    """

    files: tuple[Path, ...]
    _sizes: dict[Path, tuple[int, int, int]] = field(default_factory=dict, compare=False)

    @cached_property
    def _by_name(self) -> dict[str, list[Path]]:
        found: dict[str, list[Path]] = {}
        for file in self.files:
            for name in {file.name.lower(), file.stem.lower()}:
                found.setdefault(name, []).append(file)
        return found

    def find(self, name: str) -> Path | None:
        """Return the photo of a name with or without suffix, ignoring case; None without one.

        Two photos that differ by the suffix alone are found by their whole names only.
        """
        name = last_part(name).lower()
        stem = name.rpartition(".")[0] or name
        for key in (name, stem):
            found = self._by_name.get(key, [])
            if len(found) == 1:
                return found[0]
        return None

    def stored_size(self, file: Path) -> tuple[int, int]:
        """Return width and height as the file stores them, before EXIF turns the photo."""
        return self._facts(file)[:2]

    def orientation(self, file: Path) -> int:
        """Return EXIF's orientation of a photo, 1 without any."""
        return self._facts(file)[2]

    def _facts(self, file: Path) -> tuple[int, int, int]:
        if file not in self._sizes:
            with prefix_errors(as_text(file)), open_picture(file) as picture:
                turned = int(picture.getexif().get(0x0112, 1))
                self._sizes[file] = (picture.width, picture.height, turned)
        return self._sizes[file]


def last_part(name: str) -> str:
    """Return the file name of a path in the notation of any system."""
    return name.replace("\\", "/").rpartition("/")[2]


def parse_numbers(text: str | None, count: int, what: str) -> list[float]:
    """Return the numbers of a text that white space separates.

    Raises
    ------
    InputError : another count, or a word that is not a number; the message begins with `what`.
    """
    words = (text or "").split()
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise InputError(f"{what}: expected numbers, got {(text or '')[:60]!r}") from error
    if len(values) != count:
        raise InputError(f"{what}: expected {count} numbers, got {len(values)}")
    return values


def single_file(files: Iterable[Path], what: str) -> Path | None:
    """Return the single file, None without any; raise InputError for several."""
    found = sorted(files)
    if len(found) > 1:
        listed = ", ".join(file.name for file in found[:5])
        raise InputError(f"{found[0].parent}: holds several {what}: {listed}", "Name one of them.")
    return found[0] if found else None


def of_largest_component(found: Iterable[tuple[str, View]]) -> list[View]:
    """Return the views of the component that has most of them, the first of several.

    A program that could not join all photos puts each component into a frame of its own.

    Parameters
    ----------
    found : the name of its component and the view, of each posed photo.
    """
    components: dict[str, list[View]] = {}
    for component, view in found:
        components.setdefault(component, []).append(view)
    return max(components.values(), key=len, default=[])
