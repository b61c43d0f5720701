"""The embedded backend: semi-global matching on the CPU, fused into one surface."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError, View
from walltopo.dense.agreement import agreeing_depth
from walltopo.dense.consistency import confirmed
from walltopo.dense.contract import DenseSettings
from walltopo.dense.depth import DepthMap
from walltopo.dense.marching_cubes import extract
from walltopo.dense.neighbours import choose_neighbours
from walltopo.dense.remesh import finish
from walltopo.dense.scene import Scene, surroundings
from walltopo.dense.stereo import clipped, match_pair, undistort
from walltopo.dense.tsdf import allocate, fuse

__all__ = ["depth_maps", "sgm_mesh"]

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


def _stereo_views(
    scene: Scene, load: Callable[[str], Image], max_size: int, progress: Progress
) -> tuple[list[Image], list[View]]:
    """The photos as stereo sees them: grey, undistorted, not larger than `max_size`."""
    progress.step("undistorting photos", len(scene.views))
    images: list[Image] = []
    views: list[View] = []
    for view in scene.views:
        camera = view.camera
        factor = min(1.0, max_size / max(camera.width, camera.height))
        size = (round(camera.width * factor), round(camera.height * factor))
        image, new = undistort(load(view.name), view, size)
        images.append(image)
        views.append(new)
        progress.advance()
    return images, views


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
    load : gives a photo by name as (H, W) uint8 grey.
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
    images, views = _stereo_views(scene, load, settings.max_size, progress)
    progress.step("matching stereo pairs", sum(len(p) for p in partners))
    for k, view in enumerate(views):
        points = scene.points[scene.seen[k]]
        maps: list[NDArray[np.float32]] = []
        for j in partners[k]:
            maps.append(match_pair(images[k], view, images[j], views[j], points))
            progress.advance()
        if not maps:
            progress.detail(f"{view.name}: no stereo partner")
            continue
        others = [views[j] for j in partners[k]]
        depth, weight, pairs = agreeing_depth(maps, view, others)
        weight *= np.float32(edge**2)
        useless = (weight < 1.0 / _MAX_SIGMA_EDGES**2) | clipped(images[k])
        depth[useless], weight[useless] = 0.0, 0.0
        progress.detail(f"{view.name}: {len(maps)} pairs, {(depth > 0).mean():.0%} with depth")
        yield DepthMap(depth, weight, pairs, view)


def _consistent(
    maps: list[DepthMap],
    scene: Scene,
    partners: list[list[int]],
    edge: float,
    unless_pairs: int,
    progress: Progress,
) -> list[DepthMap]:
    """The depth maps without what the maps of their partners speak against (see `confirmed`)."""
    number = {item.view.name: k for k, item in enumerate(maps)}
    names = [view.name for view in scene.views]
    asks: dict[str, set[str]] = {name: set() for name in names}
    for name, own in zip(names, partners, strict=True):
        for other in own:
            asks[name].add(names[other])
            asks[names[other]].add(name)
    progress.step("checking depth maps against each other", len(maps))
    result: list[DepthMap] = []
    for k, item in enumerate(maps):
        others = sorted(number[name] for name in asks[item.view.name] if name in number)
        result.append(confirmed(k, maps, others, edge, unless_pairs))
        progress.advance()
    return result


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
) -> Mesh:
    """A clean mesh of the scene.

    Parameters
    ----------
    scene, load, settings, progress : as in `depth_maps`.
    edge : edge length wanted, world units.
    unit : world units that `settings` calls a metre (see `stage.edge_and_unit`).
    """
    few = len(scene.views) <= _FEW_PHOTOS
    count = max(settings.neighbours, _FEW_PARTNERS if few else 0)
    partners = choose_neighbours(scene, count)
    maps = list(depth_maps(scene, load, partners, settings, edge, progress))
    if settings.confirm != "never":
        maps = _consistent(maps, scene, partners, edge, _unless_pairs(settings, few), progress)
    low, high = surroundings(scene)
    voxel = edge / _VOXELS_PER_EDGE
    progress.step("fusing depth maps", len(maps))
    volume = allocate(
        ((item.depth, item.view) for item in maps), low, high, voxel, _TRUNCATION_VOXELS * voxel
    )
    progress.detail(f"{len(volume.blocks)} blocks of voxels of {voxel:.4g}")
    for item in maps:
        fuse(volume, item.depth, item.weight, item.view)
        progress.advance()
    progress.step("meshing")
    mesh = extract(volume, _LEAST_WEIGHT)
    del volume
    return finish(mesh, settings, edge, unit)
