"""The features of a scan's photos with the points of the mesh behind them, and their file.

Finding them takes longer than anything else that is needed to place a picture, so a scan that many
pictures are compared with keeps them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, View
from walltopo.core.files import atomic_path, hash_path
from walltopo.core.parallel import available_cores
from walltopo.geometry.rays import Bvh
from walltopo.reconstruct.scale.known_distance import undistort
from walltopo.reconstruct.sparse.feature_sets import Features
from walltopo.reconstruct.sparse.learned_features import XFeat
from walltopo.scans.document import read_arrays
from walltopo.scans.folder import ScanFolder

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Bitmap = NDArray[np.bool_]

PER_PICTURE = 1024  # features; 2048 take five times as long to match
VERSION = 1  # of the features and of the file
_ARRAYS = ("sizes", "counts", "xy", "descriptors", "points")


@dataclass(frozen=True, eq=False)
class Landmarks:
    """The features of a photo that lie on the mesh, and their (n, 3) points in the world frame."""

    features: Features
    points: Floats


def find_features(network: XFeat, picture: Image, hidden: Bitmap | None = None) -> Features:
    """Return the features of a picture outside `hidden`, (H, W) bool pixels."""
    features = network.find(picture, PER_PICTURE)
    if hidden is None:
        return features
    column, row = np.floor(features.xy).astype(np.int64).T
    height, width = hidden.shape
    kept = ~hidden[row.clip(0, height - 1), column.clip(0, width - 1)]
    return Features(features.xy[kept], features.descriptors[kept], features.size)


def find_landmarks(
    views: Sequence[View],
    bvh: Bvh,
    read: Callable[[str], Image],
    hidden: Callable[[str], Bitmap | None] = lambda _: None,
) -> tuple[Landmarks, ...]:
    """Return the landmarks of each photo.

    Parameters
    ----------
    views : the scan's registered photos. bvh : of its mesh, in the same frame.
    read : returns a photo's (H, W, 3) uint8 pixels by the view's name.
    hidden : returns the (H, W) bool pixels of people in a photo by its name, None without any.
    """
    network = XFeat()

    def of_photo(view: View) -> Landmarks:
        return _on_mesh(view, find_features(network, read(view.name), hidden(view.name)), bvh)

    with ThreadPoolExecutor(available_cores()) as pool:
        return tuple(pool.map(of_photo, views))


def landmarks_basis(folder: ScanFolder) -> str:
    """Return a hash of a scan's cameras and mesh; landmarks of others do not fit it."""
    return f"{VERSION} {hash_path(folder.sparse)} {hash_path(folder.mesh)}"


def landmarks_fit(path: Path, basis: str) -> bool:
    """Return whether a file has landmarks of this basis.

    Raises
    ------
    InputError : the file is damaged.
    """
    return path.is_file() and read_arrays(path, "basis")[0].tobytes() == basis.encode()


def save_landmarks(path: Path, photos: Sequence[Landmarks], basis: str) -> None:
    """Write the landmarks of a scan's photos, with the basis that they fit."""
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez(
            stream,
            basis=np.frombuffer(basis.encode(), np.uint8),
            sizes=np.array([one.features.size for one in photos], np.int64).reshape(-1, 2),
            counts=np.array([len(one.points) for one in photos], np.int64),
            xy=np.concatenate([one.features.xy for one in photos]).astype(np.float32),
            descriptors=np.concatenate([one.features.descriptors for one in photos]).astype(
                np.float16
            ),
            points=np.concatenate([one.points for one in photos]).astype(np.float64),
        )


def read_landmarks(path: Path, basis: str) -> tuple[Landmarks, ...] | None:
    """Return stored landmarks; None if there are none, or those of another basis.

    Raises
    ------
    InputError : the file is damaged.
    """
    if not landmarks_fit(path, basis):
        return None
    sizes, counts, xy, descriptors, points = read_arrays(path, *_ARRAYS)
    total = int(counts.sum())
    shapes = (xy.shape, descriptors.shape[:1], points.shape, sizes.shape)
    if shapes != ((total, 2), (total,), (total, 3), (len(counts), 2)):
        raise InputError(f"{path}: its arrays do not fit each other", "Delete it.")
    ends = np.cumsum(counts)
    return tuple(
        Landmarks(
            Features(
                xy[end - count : end],
                descriptors[end - count : end].astype(np.float32),
                (int(size[0]), int(size[1])),
            ),
            points[end - count : end],
        )
        for end, count, size in zip(ends, counts, sizes, strict=True)
    )


def _on_mesh(view: View, features: Features, bvh: Bvh) -> Landmarks:
    """Return the features of a photo that lie on the mesh, with their points.

    Descriptors have the precision of the file, so that a kept scan finds the same cameras.
    """
    pixels = features.xy.astype(np.float64)
    if len(pixels) == 0:
        return Landmarks(features, np.zeros((0, 3)))
    local = np.column_stack([undistort(view.camera, pixels), np.ones(len(pixels))])
    ways = local @ view.cam_from_world[:, :3]
    origins = np.broadcast_to(view.centre, ways.shape)
    face, along = bvh.first_hit(origins, ways)
    hit = face >= 0
    descriptors = features.descriptors[hit].astype(np.float16).astype(np.float32)
    kept = Features(features.xy[hit], descriptors, features.size)
    return Landmarks(kept, view.centre + along[hit, None] * ways[hit])
