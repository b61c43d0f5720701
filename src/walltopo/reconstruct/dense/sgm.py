"""The embedded backend: semi-global matching on the CPU, fused into one surface."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError, View
from walltopo.core.parallel import ahead
from walltopo.reconstruct.dense.depth_check import agreeing_depth, confirmed
from walltopo.reconstruct.dense.depth_maps import DepthMap, Shelf
from walltopo.reconstruct.dense.marching_cubes import extract
from walltopo.reconstruct.dense.neighbours import choose_neighbours
from walltopo.reconstruct.dense.remesh import finish
from walltopo.reconstruct.dense.scene import Scene, surroundings
from walltopo.reconstruct.dense.settings import DenseSettings
from walltopo.reconstruct.dense.stereo import clipped, match_pair, undistort
from walltopo.reconstruct.dense.tsdf import find_space, fused

Image = NDArray[np.uint8]

# Marching cubes' edges, once the short ones are gone, are about as long as a voxel.
_VOXELS_PER_EDGE = 1.0

_TRUNCATION_VOXELS = 4.0

# Up to as many photos, `confirm = "auto"` keeps depths that no other photo says anything about,
# and every photo gets this many partners.
_FEW_PHOTOS = 12

_FEW_PARTNERS = 6

# Among more, a depth that this many stereo pairs agree on stays unless other photos contradict
# it; all others need another photo's depth. So many pairs no photo has.
_ENOUGH_PAIRS = 2

_NEVER_ENOUGH = 255

# Summed inverse variances, in 1 / edge squared, that a spot needs to become surface.
_LEAST_WEIGHT = 0.5

# Depths whose standard deviation exceeds this many edges are too rough to use.
_MAX_SIGMA_EDGES = 2.5

# Undistorted photos that are kept for when they are a partner again: at 2 MP 128 MB.
_KEPT = 64


@dataclass(frozen=True, eq=False)
class _Stereo:
    """What the depth maps of all photos share.

    Parameters
    ----------
    load, partners, settings, edge : as in `depth_maps`.
    """

    scene: Scene
    load: Callable[[str], Image]
    partners: list[list[int]]
    settings: DenseSettings
    edge: float
    _kept: dict[int, tuple[Image, View]] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def map_of(self, k: int) -> tuple[DepthMap, int] | None:
        """The depth map of photo `k` and from how many pairs; None without a partner."""
        if not self.partners[k]:
            return None
        image, view = self._seen(k)
        points = self.scene.points[self.scene.seen[k]]
        others = [self._seen(j) for j in self.partners[k]]
        maps = [match_pair(image, view, other, partner, points) for other, partner in others]
        depth, weight, pairs = agreeing_depth(maps, view, [partner for _, partner in others])
        weight *= np.float32(self.edge**2)
        useless = (weight < 1.0 / _MAX_SIGMA_EDGES**2) | clipped(image)
        depth[useless], weight[useless] = 0.0, 0.0
        return DepthMap(depth, weight, pairs, view), len(maps)

    def _seen(self, k: int) -> tuple[Image, View]:
        """A photo as stereo sees it: grey, undistorted, not larger than asked for."""
        with self._lock:
            if k not in self._kept:
                if len(self._kept) >= _KEPT:
                    del self._kept[next(iter(self._kept))]
                view = self.scene.views[k]
                camera = view.camera
                factor = min(1.0, self.settings.max_size / max(camera.width, camera.height))
                size = (round(camera.width * factor), round(camera.height * factor))
                self._kept[k] = undistort(self.load(view.name), view, size)
            return self._kept[k]


def depth_maps(
    scene: Scene,
    load: Callable[[str], Image],
    partners: list[list[int]],
    settings: DenseSettings,
    edge: float,
    progress: Progress,
) -> Iterator[DepthMap]:
    """Depth maps of the photos that have stereo partners.

    Parameters
    ----------
    scene : views and sparse points.
    load : gives a photo by name as (H, W) uint8 grey; called from several threads.
    partners : per view, its stereo partners (see `choose_neighbours`).
    settings : see `DenseSettings`.
    edge : edge length wanted, world units; depths much rougher than it are dropped.
    progress : told per photo.
    """
    if not any(partners):
        raise StageError(
            "no two photos overlap at a useful angle; no depth can be measured",
            "Move sideways between photos: about one arm's length at 3 m from the wall.",
        )

    stereo = _Stereo(scene, load, partners, settings, edge)
    progress.step("matching stereo pairs", sum(len(p) for p in partners))
    photos = range(len(scene.views))
    # OpenCV's matching gains little from a second thread, and everything from a second photo.
    with opencv_in_one_thread():
        found = ahead(stereo.map_of, photos)
        for view, own, made in zip(scene.views, partners, found, strict=True):
            progress.advance(len(own))
            if made is None:
                progress.detail(f"{view.name}: no stereo partner")
                continue
            item, pairs = made
            progress.detail(f"{view.name}: {pairs} pairs, {(item.depth > 0).mean():.0%} with depth")
            yield item


def _consistent(
    maps: Sequence[DepthMap],
    scene: Scene,
    partners: list[list[int]],
    edge: float,
    unless_pairs: int,
    progress: Progress,
) -> Iterator[DepthMap]:
    """The depth maps without what the maps of their partners speak against (see `confirmed`)."""
    number = {item.view.name: k for k, item in enumerate(maps)}
    names = [view.name for view in scene.views]
    asks: dict[str, set[str]] = {name: set() for name in names}
    for name, own in zip(names, partners, strict=True):
        for other in own:
            asks[name].add(names[other])
            asks[names[other]].add(name)
    progress.step("checking depth maps against each other", len(maps))
    for k, item in enumerate(maps):
        others = sorted(number[name] for name in asks[item.view.name] if name in number)
        yield confirmed(k, maps, others, edge, unless_pairs)
        progress.advance()


def _unless_pairs(settings: DenseSettings, few: bool) -> int:
    """Stereo pairs from which on a depth needs no other photo's (see `confirmed`)."""
    if settings.confirm == "always":
        return _NEVER_ENOUGH
    # Among few photos a depth that nothing contradicts is better than a hole.
    return 0 if few else _ENOUGH_PAIRS


def sgm_mesh(
    scene: Scene,
    load: Callable[[str], Image],
    settings: DenseSettings,
    edge: float,
    unit: float,
    progress: Progress,
    scratch: Path | None = None,
) -> Mesh:
    """A clean mesh of the scene.

    Parameters
    ----------
    scene, load, settings, progress : as in `depth_maps`.
    edge : edge length wanted, world units.
    unit : world units that `settings` calls a metre (see `stage.edge_and_unit`).
    scratch : folder for depth maps, which take nine bytes a pixel of each photo, up to twice;
        without one where temporary files are.
    """
    few = len(scene.views) <= _FEW_PHOTOS
    count = max(settings.neighbours, _FEW_PARTNERS if few else 0)
    partners = choose_neighbours(scene, count)
    found = depth_maps(scene, load, partners, settings, edge, progress)
    maps = Shelf(found, scratch)
    if settings.confirm != "never":
        enough = _unless_pairs(settings, few)
        maps = Shelf(_consistent(maps, scene, partners, edge, enough, progress), scratch)
    low, high = surroundings(scene)
    voxel = edge / _VOXELS_PER_EDGE
    space = find_space(
        ((item.depth, item.view) for item in maps), low, high, voxel, _TRUNCATION_VOXELS * voxel
    )
    return finish(extract(fused(space, maps, progress), _LEAST_WEIGHT), settings, edge, unit)


@contextmanager
def opencv_in_one_thread() -> Iterator[None]:
    """While this is open, OpenCV works in the thread that calls it alone, in the whole process."""
    import cv2

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
