"""Photos of the rendered gym at half size, and where their cameras truly are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import Photo, PhotoList

Floats = NDArray[np.float64]


def put_photos(folder: Path, files: list[Path], focal: float | None) -> ScanFolder:
    """A scan folder after ingest, photos at half size."""
    scan = ScanFolder(folder)
    scan.photos.mkdir(parents=True)
    entries = []
    for file in files:
        with Image.open(file) as image:
            small = image.convert("RGB").reduce(2)
        small.save(scan.photos / file.name, quality=95)
        entries.append(Photo(file.name, small.width, small.height, focal, file.name, 100.0))
    PhotoList(photos=tuple(entries)).save(scan.photo_list)
    return scan


def chosen(folder: Path, numbers: list[int]) -> list[Path]:
    return [folder / "photos" / f"IMG_{number:04d}.jpg" for number in numbers]


def true_centres(folder: Path, numbers: list[int]) -> Floats:
    poses = np.load(folder / "gt.npz")["cam_from_world"][numbers]
    turned: Floats = np.einsum("nji,nj->ni", poses[:, :, :3], poses[:, :, 3])
    return -turned
