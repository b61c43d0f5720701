"""Fuse depth maps into a truncated signed distance field in sparse blocks of voxels.

After Curless and Levoy, "A volumetric method for building complex models from range images",
1996: per voxel the weighted mean of the signed distances along the cameras' axes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress, StageError, View
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.reconstruct.dense.depth_maps import DepthMap

Floats = NDArray[np.float64]
Depth = NDArray[np.float32]

BLOCK = 8
# Blocks with fewer depth pixels are noise, not surface.
_MIN_HITS = 24
# 1 GB of voxels (8 bytes each) is in memory at once; the total is limited to 32 times as many.
_MAX_BLOCKS_IN_MEMORY = 250_000
_MAX_BLOCKS = 8_000_000
_MAX_GRID = 200_000_000


@dataclass(frozen=True, eq=False)
class Space:
    """The blocks of BLOCK^3 voxels in which surface may lie, without voxel values.

    Parameters
    ----------
    origin : (3,) float64, world.
    voxel : voxel size, world units.
    truncation : distance at which the signed distance saturates, world units.
    blocks : (B, 3) int32 block coordinates, in lexicographic order.
    shape : number of blocks along each axis.
    """

    origin: Floats
    voxel: float
    truncation: float
    blocks: NDArray[np.int32]
    shape: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Volume:
    """Blocks of BLOCK^3 voxels; voxel (i, j, k) of block b lies at the grid point
    origin + voxel * (BLOCK * blocks[b] + (i, j, k)).

    Parameters
    ----------
    origin : (3,) float64, world.
    voxel : voxel size, world units.
    truncation : distance at which the signed distance saturates, world units.
    blocks : (B, 3) int32 block coordinates: the volume's `own` blocks first, then the blocks that
        follow them along each axis. The cubes of the own blocks need the voxels of both.
    own : number of own blocks.
    grid : (X, Y, Z) int32, maps block coordinates to the block's index, -1 = none.
    distance : (B, BLOCK, BLOCK, BLOCK) float32 in [-1, 1], in units of the truncation, > 0 outside.
    weight : same shape, float32, summed weights of the observations.
    """

    origin: Floats
    voxel: float
    truncation: float
    blocks: NDArray[np.int32]
    own: int
    grid: NDArray[np.int32]
    distance: Depth
    weight: Depth


@kernel
def _count_hits(
    depth: Depth,
    inverse_k: Floats,
    world_from_cam: Floats,
    origin: Floats,
    side: float,
    reach: float,
    hits: NDArray[np.uint16],
    low: Floats,
    high: Floats,
) -> None:
    """Count depth pixels per block, in every block within `reach` of the pixel's point."""
    height, width = depth.shape
    for y in range(0, height, 2):
        for x in range(0, width, 2):
            z = depth[y, x]
            if z <= 0.0:
                continue
            cx = (x * inverse_k[0] + inverse_k[1]) * z
            cy = (y * inverse_k[2] + inverse_k[3]) * z
            inside = True
            first = np.empty(3, np.int64)
            last = np.empty(3, np.int64)
            for a in range(3):
                p = (
                    world_from_cam[a, 0] * cx
                    + world_from_cam[a, 1] * cy
                    + world_from_cam[a, 2] * z
                    + world_from_cam[a, 3]
                )
                if p < low[a] or p > high[a]:
                    inside = False
                    break
                first[a] = max(0, int(np.floor((p - reach - origin[a]) / side)))
                last[a] = min(hits.shape[a] - 1, int(np.floor((p + reach - origin[a]) / side)))
            if not inside:
                continue
            for i in range(first[0], last[0] + 1):
                for j in range(first[1], last[1] + 1):
                    for k in range(first[2], last[2] + 1):
                        if hits[i, j, k] < 65535:
                            hits[i, j, k] += 1


@kernel
def _integrate(
    begin: int,
    end: int,
    depth: Depth,
    confidence: Depth,
    k4: Floats,
    pose: Floats,
    origin: Floats,
    voxel: float,
    truncation: float,
    blocks: NDArray[np.int32],
    distance: Depth,
    weight: Depth,
) -> None:
    """Average one depth map into the blocks (in place)."""
    height, width = depth.shape
    size = distance.shape[1]
    radius = voxel * size * 0.8661
    for b in range(begin, end):
        c = np.empty(3)
        half = 0.5 * (size - 1)
        for a in range(3):
            c[a] = 0.0
        for r in range(3):
            c[r] = pose[r, 3]
            for a in range(3):
                c[r] += pose[r, a] * (origin[a] + voxel * (blocks[b, a] * size + half))
        if c[2] < -radius:
            continue
        if c[2] > 2.0 * radius:
            # Skip blocks whose bounding sphere, with a margin, projects outside the image.
            reach = radius / (c[2] - radius) * 1.5
            u, v = c[0] / c[2], c[1] / c[2]
            if (
                (u + reach) * k4[0] + k4[2] < 0
                or (u - reach) * k4[0] + k4[2] > width
                or (v + reach) * k4[1] + k4[3] < 0
                or (v - reach) * k4[1] + k4[3] > height
            ):
                continue
        for i in range(size):
            for j in range(size):
                for k in range(size):
                    px = origin[0] + voxel * (blocks[b, 0] * size + i)
                    py = origin[1] + voxel * (blocks[b, 1] * size + j)
                    pz = origin[2] + voxel * (blocks[b, 2] * size + k)
                    z = pose[2, 0] * px + pose[2, 1] * py + pose[2, 2] * pz + pose[2, 3]
                    if z <= 0.0:
                        continue
                    x = pose[0, 0] * px + pose[0, 1] * py + pose[0, 2] * pz + pose[0, 3]
                    y = pose[1, 0] * px + pose[1, 1] * py + pose[1, 2] * pz + pose[1, 3]
                    u = int(np.floor(x / z * k4[0] + k4[2]))
                    v = int(np.floor(y / z * k4[1] + k4[3]))
                    if u < 0 or v < 0 or u >= width or v >= height:
                        continue
                    d = depth[v, u]
                    if d <= 0.0:
                        continue
                    signed = (d - z) / truncation
                    if signed < -1.0:
                        continue
                    w = confidence[v, u]
                    signed = min(signed, 1.0)
                    total = weight[b, i, j, k] + w
                    distance[b, i, j, k] += (signed - distance[b, i, j, k]) * w / total
                    weight[b, i, j, k] = total


def _unprojection_of(view: View) -> tuple[Floats, Floats]:
    """Return the pixel-to-ray mapping (1/fx, offset, 1/fy, offset) and world_from_cam (3, 4)."""
    camera = view.camera
    inverse_k = np.array(
        [
            1 / camera.fx,
            (0.5 - camera.cx) / camera.fx,
            1 / camera.fy,
            (0.5 - camera.cy) / camera.fy,
        ]
    )
    rotation = view.cam_from_world[:, :3].T
    return inverse_k, np.ascontiguousarray(np.column_stack([rotation, view.centre]))


def find_space(
    depths: Iterable[tuple[Depth, View]],
    low: Floats,
    high: Floats,
    voxel: float,
    truncation: float,
) -> Space:
    """Return the blocks near the depth maps' surfaces.

    Parameters
    ----------
    depths : pairs of an (H, W) float32 depth map (0 = unknown) and its pinhole view.
    low, high : (3,) corners of the world box; points outside it are ignored.
    voxel, truncation : world units.

    Raises
    ------
    StageError : no depth lies in the box, or the voxels exceed the memory limit.
    """
    side = voxel * BLOCK
    origin = low - truncation - side
    shape = np.ceil((high - low + 2 * truncation) / side).astype(np.int64) + 3
    if shape.prod() > _MAX_GRID:
        raise _too_fine(voxel)
    hits = np.zeros(tuple(shape.tolist()), dtype=np.uint16)
    for depth, view in depths:
        inverse_k, world_from_cam = _unprojection_of(view)
        _count_hits(depth, inverse_k, world_from_cam, origin, side, truncation, hits, low, high)
    blocks = np.argwhere(hits >= _MIN_HITS).astype(np.int32)
    if len(blocks) == 0:
        raise StageError(
            "no depth could be computed for any photo, so there is no mesh",
            "The photos need overlap and texture: stand 2 to 4 m from the wall and move "
            "sideways between photos.",
        )
    if len(blocks) > _MAX_BLOCKS:
        raise _too_fine(voxel)
    return Space(origin, voxel, truncation, blocks, hits.shape)


def _split_space(space: Space) -> Iterator[Volume]:
    """Split the space into empty volumes of at most `_MAX_BLOCKS_IN_MEMORY` own blocks."""
    blocks = space.blocks
    for begin in range(0, len(blocks), _MAX_BLOCKS_IN_MEMORY):
        end = min(begin + _MAX_BLOCKS_IN_MEMORY, len(blocks))
        # Blocks are sorted by x, so the blocks that follow a block lie at most one x layer further.
        after = int(np.searchsorted(blocks[:, 0], blocks[end - 1, 0] + 1, side="right"))
        some = blocks[begin:after]
        grid = np.full(space.shape, -1, dtype=np.int32)
        grid[tuple(some.T)] = np.arange(len(some), dtype=np.int32)
        size = (len(some), BLOCK, BLOCK, BLOCK)
        distance, weight = np.ones(size, dtype=np.float32), np.zeros(size, dtype=np.float32)
        yield Volume(
            space.origin, space.voxel, space.truncation, some, end - begin, grid, distance, weight
        )
        del grid, distance, weight


def _too_fine(voxel: float) -> StageError:
    return StageError(
        f"an edge length of {voxel:.4g} needs more voxels than fit in memory",
        "Set a larger dense.edge_length (or dense.edge_pixels).",
    )


def fuse(space: Space, maps: Sequence[DepthMap], progress: Progress) -> Iterator[Volume]:
    """Yield the volumes of the space with the depth maps averaged into them.

    Parameters
    ----------
    maps : depth maps of all photos; read once per volume.
    progress : advances per map and volume.
    """
    parts = (len(space.blocks) + _MAX_BLOCKS_IN_MEMORY - 1) // _MAX_BLOCKS_IN_MEMORY
    progress.step("fusing depth maps", parts * len(maps))
    progress.detail(f"{len(space.blocks)} blocks of voxels of {space.voxel:.4g}")
    for volume in _split_space(space):
        for item in maps:
            _fuse_depth_map(volume, item.depth, item.weight, item.view)
            progress.advance()
        yield volume
        del volume


def _fuse_depth_map(volume: Volume, depth: Depth, confidence: Depth, view: View) -> None:
    """Average one depth map into the volume."""
    camera = view.camera
    k4 = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    in_ranges(
        _integrate,
        len(volume.blocks),
        depth,
        confidence,
        k4,
        view.cam_from_world,
        volume.origin,
        volume.voxel,
        volume.truncation,
        volume.blocks,
        volume.distance,
        volume.weight,
    )
