"""Compute a mesh by semi-global matching on the CPU: the embedded dense backend."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError, View
from walltopo.core.parallel import map_ahead
from walltopo.reconstruct.dense.backend import DenseInput
from walltopo.reconstruct.dense.depth_maps import (
    DepthMap,
    DepthMapStore,
    keep_confirmed,
    merge_pair_depths,
)
from walltopo.reconstruct.dense.marching_cubes import extract
from walltopo.reconstruct.dense.neighbours import choose_neighbours
from walltopo.reconstruct.dense.remesh import finish_surface
from walltopo.reconstruct.dense.scene import Scene, meshing_box
from walltopo.reconstruct.dense.stereo import clipped_mask, match_pair, undistort
from walltopo.reconstruct.dense.tsdf import find_space, fuse
from walltopo.reconstruct.settings import DenseSettings

Image = NDArray[np.uint8]
# Returns the pixels of a photo that have no depth, (H, W) bool, by the photo's name; None: no such.
Hidden = Callable[[str], NDArray[np.bool_] | None]

# After the collapse of short edges, marching cubes' edges are about one voxel long.
_VOXELS_PER_EDGE = 1.0

_TRUNCATION_VOXELS = 4.0

# Up to _FEW_PHOTOS photos, `confirm = "auto"` keeps unconfirmed depths that no photo contradicts,
# and every photo gets at least _FEW_PARTNERS partners.
_FEW_PHOTOS = 12

_FEW_PARTNERS = 6

# In larger scans, a depth on which this many stereo pairs agree stays unless other photos
# contradict it. All other depths need a confirming photo. No photo has _NEVER_ENOUGH pairs.
_ENOUGH_PAIRS = 2

_NEVER_ENOUGH = 255

# Minimum summed inverse variance of a surface voxel, in 1 / edge squared.
_MIN_WEIGHT = 0.5

# Depths with a larger standard deviation, in edges, are dropped.
_MAX_SIGMA_EDGES = 2.5

# Number of undistorted photos cached for reuse as partners; 128 MB at 2 MP.
_MAX_CACHED = 64


@dataclass(frozen=True, eq=False)
class _Stereo:
    """Computes the depth map of each photo from its stereo partners.

    Parameters
    ----------
    scene, load, partners, settings, edge, hidden : as in `depth_maps`.
    """

    scene: Scene
    load: Callable[[str], Image]
    partners: list[list[int]]
    settings: DenseSettings
    edge: float
    hidden: Hidden | None = None
    _cache: dict[int, tuple[Image, View]] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def depth_map(self, k: int) -> tuple[DepthMap, int] | None:
        """Return the depth map of photo `k` and its number of stereo pairs; None without a
        partner."""
        if not self.partners[k]:
            return None
        image, view = self._undistorted(k)
        points = self.scene.points[self.scene.seen[k]]
        others = [self._undistorted(j) for j in self.partners[k]]
        maps = [match_pair(image, view, other, partner, points) for other, partner in others]
        depth, weight, pairs = merge_pair_depths(maps, view, [partner for _, partner in others])
        weight *= np.float32(self.edge**2)
        useless = (weight < 1.0 / _MAX_SIGMA_EDGES**2) | clipped_mask(image)
        mask = self.hidden(view.name) if self.hidden is not None else None
        if mask is not None:
            size = (image.shape[1], image.shape[0])
            straight, _ = undistort(mask.astype(np.uint8) * 255, self.scene.views[k], size)
            useless |= straight > 0
        depth[useless], weight[useless] = 0.0, 0.0
        return DepthMap(depth, weight, pairs, view), len(maps)

    def _undistorted(self, k: int) -> tuple[Image, View]:
        """Return a photo as grey, undistorted and reduced to `settings.max_size`, and its view."""
        with self._lock:
            if k not in self._cache:
                if len(self._cache) >= _MAX_CACHED:
                    del self._cache[next(iter(self._cache))]
                view = self.scene.views[k]
                camera = view.camera
                factor = min(1.0, self.settings.max_size / max(camera.width, camera.height))
                size = (round(camera.width * factor), round(camera.height * factor))
                self._cache[k] = undistort(self.load(view.name), view, size)
            return self._cache[k]


def depth_maps(
    scene: Scene,
    load: Callable[[str], Image],
    partners: list[list[int]],
    settings: DenseSettings,
    edge: float,
    progress: Progress,
    hidden: Hidden | None = None,
) -> Iterator[DepthMap]:
    """Yield the depth maps of the photos that have stereo partners.

    Parameters
    ----------
    scene : views and sparse points.
    load : returns the photo of a name as (H, W) uint8 grey; called from several threads.
    partners : per view, its stereo partners (see `choose_neighbours`).
    settings : see `DenseSettings`.
    edge : target edge length, world units; depths with a much larger error are dropped.
    progress : advances per photo.
    hidden : returns the pixels of a photo that get no depth; None: all may have one.
    """
    if not any(partners):
        raise StageError(
            "no two photos overlap at a useful angle; no depth can be measured",
            "Move sideways between photos: about one arm's length at 3 m from the wall.",
        )

    stereo = _Stereo(scene, load, partners, settings, edge, hidden)
    progress.step("matching stereo pairs", sum(len(p) for p in partners))
    photos = range(len(scene.views))
    # OpenCV's matching gains little from a second thread; processing photos in parallel gains more.
    with opencv_in_one_thread():
        found = map_ahead(stereo.depth_map, photos)
        for view, own, result in zip(scene.views, partners, found, strict=True):
            progress.advance(len(own))
            if result is None:
                progress.detail(f"{view.name}: no stereo partner")
                continue
            item, pairs = result
            progress.detail(f"{view.name}: {pairs} pairs, {(item.depth > 0).mean():.0%} with depth")
            yield item


def _consistent_maps(
    maps: Sequence[DepthMap],
    scene: Scene,
    partners: list[list[int]],
    edge: float,
    unless_pairs: int,
    progress: Progress,
) -> Iterator[DepthMap]:
    """Yield the depth maps without pixels that partners contradict (see `keep_confirmed`)."""
    number = {item.view.name: k for k, item in enumerate(maps)}
    names = [view.name for view in scene.views]
    voters: dict[str, set[str]] = {name: set() for name in names}
    for name, own in zip(names, partners, strict=True):
        for other in own:
            voters[name].add(names[other])
            voters[names[other]].add(name)
    progress.step("checking depth maps against each other", len(maps))
    for k, item in enumerate(maps):
        others = sorted(number[name] for name in voters[item.view.name] if name in number)
        yield keep_confirmed(k, maps, others, edge, unless_pairs)
        progress.advance()


def _min_pairs(settings: DenseSettings, few: bool) -> int:
    """Return the number of own stereo pairs from which a depth needs no confirmation."""
    if settings.confirm == "always":
        return _NEVER_ENOUGH
    # In a small scan an uncontradicted depth is better than a hole.
    return 0 if few else _ENOUGH_PAIRS


def sgm_mesh(
    scene: Scene,
    load: Callable[[str], Image],
    settings: DenseSettings,
    edge: float,
    unit: float,
    progress: Progress,
    scratch: Path | None = None,
    hidden: Hidden | None = None,
) -> Mesh:
    """Compute a clean mesh of the scene.

    Parameters
    ----------
    scene, load, settings, progress, hidden : as in `depth_maps`.
    edge : target edge length, world units.
    unit : length of a settings metre, world units (see `make_mesh.edge_and_unit`).
    scratch : folder for depth maps, by default the system's temporary folder; they take up to
        18 bytes per pixel of each photo.
    """
    few = len(scene.views) <= _FEW_PHOTOS
    count = max(settings.neighbours, _FEW_PARTNERS if few else 0)
    partners = choose_neighbours(scene, count)
    found = depth_maps(scene, load, partners, settings, edge, progress, hidden)
    maps = DepthMapStore(found, scratch)
    if settings.confirm != "never":
        enough = _min_pairs(settings, few)
        maps = DepthMapStore(
            _consistent_maps(maps, scene, partners, edge, enough, progress), scratch
        )
    low, high = meshing_box(scene)
    voxel = edge / _VOXELS_PER_EDGE
    space = find_space(
        ((item.depth, item.view) for item in maps), low, high, voxel, _TRUNCATION_VOXELS * voxel
    )
    return finish_surface(extract(fuse(space, maps, progress), _MIN_WEIGHT), settings, edge, unit)


@dataclass(frozen=True)
class SgmBackend:
    """The embedded stereo, a `DenseBackend`."""

    name: str
    settings: DenseSettings

    def check(self) -> None:
        """Raise nothing: every machine has what the embedded stereo needs."""

    def mesh(self, scan: DenseInput) -> Mesh:
        """Return the mesh; see `sgm_mesh`."""
        load, hidden = scan.photos.read_grey, scan.photos.people_mask
        return sgm_mesh(
            scan.scene, load, self.settings, scan.edge, scan.unit, scan.progress, scan.cache, hidden
        )


@contextmanager
def opencv_in_one_thread() -> Iterator[None]:
    """Limit OpenCV in the whole process to the calling thread during the block."""
    import cv2

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
