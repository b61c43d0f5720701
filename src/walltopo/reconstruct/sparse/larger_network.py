"""Find ALIKED features and LightGlue matches, if the package `walltopo-features` is installed."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from walltopo.core import EnvironmentLacksError
from walltopo.images.networks import Network, open_network
from walltopo.reconstruct.sparse.feature_sets import Features, match_features, shrink_photo

PACKAGE = "walltopo_features"
_MAX_SIDE = 1024  # px; larger photos are reduced to this longer side, as the authors do
_STRIDE = 32  # side lengths must be multiples: the network reduces the photo so far
_MIN_SCORE = 0.05


def larger_network_files() -> tuple[Path, Path] | None:
    """Return the files of the two networks, None if their package is not installed."""
    spec = find_spec(PACKAGE)
    if spec is None or spec.origin is None:
        return None
    folder = Path(spec.origin).parent
    return folder / "aliked.onnx", folder / "lightglue.onnx"


def require_larger_network() -> tuple[Path, Path]:
    """Return the files of the two networks.

    Raises
    ------
    EnvironmentLacksError : their package is not installed.
    """
    files = larger_network_files()
    if files is None:
        raise EnvironmentLacksError(
            "the larger network is missing", "pip install 'walltopo[features]'"
        )
    return files


class Aliked:
    """The ALIKED and LightGlue networks; several threads may call them."""

    def __init__(self, extract: Path, match: Path, threads: int) -> None:
        self._extract: Network = open_network(extract, threads=threads)
        self._match: Network = open_network(match, threads=1)
        self._lock = Lock()  # a photo needs 1.5 GB of memory: one at a time

    def find(self, photo: NDArray[np.uint8], max_: int) -> Features:
        """Return the strongest features of a photo.

        Parameters
        ----------
        photo : (height, width, 3) uint8.
        max_ : maximum number of features.
        """
        height, width = photo.shape[:2]
        reduced, scale = shrink_photo(photo, _MAX_SIDE, _STRIDE, 2 * _STRIDE)
        inputs = {"photo": np.ascontiguousarray(reduced.transpose(2, 0, 1))[None] / 255}
        with self._lock:
            points, scores, descriptors = self._extract.session.run(None, inputs)
        kept = np.flatnonzero(scores > _MIN_SCORE)[:max_]
        xy = ((points[kept] + 0.5) * scale).astype(np.float32)
        return Features(xy, descriptors[kept], (width, height))

    def match(self, a: Features, b: Features) -> NDArray[np.uint32]:
        """Return (m, 2) feature indices of `a` and `b` that match."""
        return match_features(self._match, a, b)
