"""Which files the user means: folders, photos, videos."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from walltopo.core import InputError
from walltopo.photos.image_file import PHOTO_SUFFIXES
from walltopo.photos.video import VIDEO_SUFFIXES

__all__ = ["find_sources"]


def find_sources(given: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Photo and video files in natural order, and the files in the folders that are neither.

    Raises
    ------
    InputError : a path does not exist, or nothing usable is there at all.
    """
    usable: list[Path] = []
    others: list[Path] = []
    for path in given:
        if not path.exists():
            raise InputError(f"{path}: no such file or folder")
        for file in sorted(_files(path), key=_natural):
            known = file.suffix.lower() in PHOTO_SUFFIXES | VIDEO_SUFFIXES
            (usable if known else others).append(file)
    if not usable:
        names = ", ".join(str(path) for path in given)
        raise InputError(
            f"{names}: no photos here",
            "Give a folder of photos (JPEG, PNG, HEIC, WebP, TIFF), photo files, or a video.",
        )
    return list(dict.fromkeys(usable)), others


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    return [p for p in path.iterdir() if p.is_file() and not p.name.startswith(".")]


def _natural(path: Path) -> list[tuple[int, int | str]]:
    """IMG_2 before IMG_10."""
    parts = re.split(r"(\d+)", path.name.lower())
    return [(0, int(part)) if part.isdigit() else (1, part) for part in parts]
