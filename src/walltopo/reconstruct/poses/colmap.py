"""Read a COLMAP model, binary or text.

Source: https://colmap.github.io/format.html. The frame has any unit and direction.
"""

from __future__ import annotations

from pathlib import Path

from walltopo.reconstruct.poses.export import Export, PhotoFiles
from walltopo.scans.colmap_model import read_views

_PLACES = ("", "0", "sparse", "sparse/0", "colmap/sparse/0", "dense/sparse")


def find_poses(path: Path) -> Path | None:
    """Return the folder of the model at or in a path; None without one."""
    folder = path.parent if path.is_file() and path.stem in ("images", "cameras") else path
    for place in _PLACES:
        for suffix in (".bin", ".txt"):
            names = (f"cameras{suffix}", f"images{suffix}", f"points3D{suffix}")
            if all((folder / place / name).is_file() for name in names):
                return folder / place
    return None


def find_photos(poses: Path) -> Path | None:
    """Return the folder `images` beside or above the model."""
    for folder in (poses, *list(poses.parents)[:3]):
        if (folder / "images").is_dir():
            return folder / "images"
    return None


def read(poses: Path, photos: PhotoFiles) -> Export:
    """Return the poses of a model; raise InputError as `read_views`."""
    return Export(read_views(poses))
