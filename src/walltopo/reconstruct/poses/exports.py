"""Find photos, poses and mesh in the folder that an app exported."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import InputError
from walltopo.reconstruct.poses.formats import FORMATS, find_format, format_named, read_poses
from walltopo.scans.poses import GivenPoses

# Apps whose export of photos with poses no public page describes.
UNDOCUMENTED = {"scaniverse": "Scaniverse"}

APPS = ("auto", *(item.name for item in FORMATS), *UNDOCUMENTED)

_MESHES = (".obj", ".glb", ".ply")


@dataclass(frozen=True)
class FoundExport:
    """The content of an export.

    Parameters
    ----------
    title : the format, for people.
    poses : file or folder; photos : folder of the photos.
    meshes : files with triangles.
    given : the poses of the photos.
    """

    title: str
    poses: Path
    photos: Path
    meshes: tuple[Path, ...]
    given: GivenPoses


def find_poses(app: str, folder: Path) -> tuple[str, Path, Path | None]:
    """Return the title of the format, the poses and the folder of the photos, if any.

    Raises
    ------
    InputError : the app's layout is not documented, or the folder does not hold it.
    """
    if app in UNDOCUMENTED:
        raise InputError(
            f"{folder}: the layout of {UNDOCUMENTED[app]}'s photos with poses is not documented, "
            "so it is not read",
            "Scan its photos without poses: `walltopo scan PHOTOS -o SCAN`.",
        )
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    if app == "auto":
        item, poses = find_format(folder)
    else:
        item = format_named(app)
        found = item.find_poses(folder)
        if found is None:
            raise InputError(
                f"{folder}: is not the layout of {item.title}",
                "`walltopo import auto FOLDER` tries all formats.",
            )
        poses = found
    return item.title, poses, item.find_photos(poses)


def read_export(
    folder: Path, title: str, poses: Path, photos: Path, files: Sequence[Path]
) -> FoundExport:
    """Return the content of an export.

    Parameters
    ----------
    folder : the whole export; its meshes lie there or beside the poses.
    files : the photos in the folder `photos`.

    Raises
    ------
    InputError : see `formats.read_poses`.
    """
    given = read_poses(poses, files)
    beside = poses if poses.is_dir() else poses.parent
    places = dict.fromkeys((folder.resolve(), beside.resolve()))
    found = (file for place in places for file in sorted(place.iterdir()) if _has_triangles(file))
    return FoundExport(title, poses, photos, tuple(found), given)


def _has_triangles(file: Path) -> bool:
    """Return whether a file is a mesh; a PLY without faces is a cloud of points."""
    suffix = file.suffix.lower()
    if suffix not in _MESHES or not file.is_file():
        return False
    if suffix != ".ply":
        return True
    with file.open("rb") as stream:
        head = stream.read(64_000).partition(b"end_header")[0]
    return b"element face" in head and b"element face 0" not in head
