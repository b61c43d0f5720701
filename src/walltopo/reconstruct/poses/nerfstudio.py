"""Read nerfstudio's `transforms.json`.

Source: https://docs.nerf.studio/quickstart/data_conventions.html (see `walltopo.scans.transforms`).
The frame has any unit and direction: `transforms.json` does not say whether an app measured them.
"""

from __future__ import annotations

from pathlib import Path

from walltopo.reconstruct.poses.export import Export, PhotoFiles
from walltopo.scans.transforms import read_transforms

NAME = "transforms.json"


def find_poses(path: Path) -> Path | None:
    """Return the file at or in a path; None without one."""
    file = path / NAME if path.is_dir() else path
    return file if file.name == NAME and file.is_file() else None


def find_photos(poses: Path) -> Path | None:
    """Return the folder of the photos beside the file."""
    folder = poses.with_name("images")
    return folder if folder.is_dir() else None


def read(poses: Path, photos: PhotoFiles) -> Export:
    """Return the poses of a file; raise InputError as `read_transforms`."""
    return Export(read_transforms(poses))
