"""The frames of a clip: camera, limbs in the picture, and their distances from the wall's holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from walltopo.core import Camera, InputError

Floats = npt.NDArray[np.float64]

LIMBS = 4  # left hand, right hand, left foot, right foot, as `movement.sequence.LIMBS`


@dataclass(frozen=True)
class Frames:
    """The limbs of a climber in the frames of a clip whose camera and its poses are known.

    Parameters
    ----------
    times : (F,) s, ascending.
    points : (F, 4, 2) px, where each limb touches or would touch the wall: the fingers, the toes.
    confidence : (F, 4) in [0, 1]; 0 where a limb is not seen.
    hips : (F, 2) px, the middle of the hips.
    camera : of the clip.
    cam_from_world : (F, 3, 4), metres; COLMAP's axes (x right, y down, z ahead).

    Raises
    ------
    InputError : the arrays do not fit each other, or times do not ascend.
    """

    times: Floats
    points: Floats
    confidence: Floats
    hips: Floats
    camera: Camera
    cam_from_world: Floats

    def __post_init__(self) -> None:
        n = len(self.times)
        shapes = {
            "points": (self.points, (n, LIMBS, 2)),
            "confidence": (self.confidence, (n, LIMBS)),
            "hips": (self.hips, (n, 2)),
            "cam_from_world": (self.cam_from_world, (n, 3, 4)),
        }
        for name, (array, wanted) in shapes.items():
            if array.shape != wanted:
                raise InputError(f"{name} has the shape {array.shape}, expected {wanted}")
        if n < 2 or (np.diff(self.times) <= 0).any():
            raise InputError("a clip needs two frames or more, with ascending times")

    def project(self, frame: int, places: Floats) -> tuple[Floats, Floats]:
        """Return pixels and depths of places in a frame.

        Parameters
        ----------
        places : (..., 3) m, world frame.

        Returns
        -------
        (..., 2) px and (...) m; the pixels are NaN where the depth is not positive.
        """
        pose = self.cam_from_world[frame]
        seen = places @ pose[:, :3].T + pose[:, 3]
        return self.camera.project(seen), seen[..., 2]


@dataclass(frozen=True)
class WallHolds:
    """The holds that a limb can be on.

    Parameters
    ----------
    ids : (N,) hold ids. surface : (N, K, 3) m, points spread over each hold's surface.
    is_volume : (N,) bool; of a hold and the volume below it, a limb uses the hold.
    """

    ids: npt.NDArray[np.int64]
    surface: Floats
    is_volume: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        if self.is_volume.shape != self.ids.shape:
            raise InputError("is_volume needs one value for each of ids")
        if self.surface.ndim != 3 or self.surface.shape[::2] != (len(self.ids), 3):
            raise InputError(f"surface has the shape {self.surface.shape}, expected (N, K, 3)")


@dataclass(frozen=True)
class Observations:
    """Distances and speeds of the limbs beside each hold, in metres on the wall.

    Parameters
    ----------
    distance : (F, 4, N) m from the outline; 0 inside, infinite behind the camera.
    speed : (F, 4, N) m/s, relative to the hold, so that a moving camera counts for nothing.
    metres_per_px : (F,) at the depth of the holds nearest to the hips.
    """

    distance: Floats
    speed: Floats
    metres_per_px: Floats


def observe(frames: Frames, holds: WallHolds) -> Observations:
    """Return distances and speeds of the limbs beside the holds.

    A pixel is worth what it covers at the depth of the hold. The outline is that of the surface's
    points, so the distance errs by about half of their spacing.
    """
    n, count = len(frames.times), len(holds.ids)
    distance = np.full((n, LIMBS, count), np.inf)
    offset = np.zeros((n, LIMBS, count, 2))
    per_px = np.zeros(n)
    focal = (frames.camera.fx + frames.camera.fy) / 2
    for frame in range(n):
        pixels, depth = frames.project(frame, holds.surface)
        scale = np.median(depth, axis=1) / focal  # m of a pixel, (N,)
        limbs = frames.points[frame]
        gaps = np.linalg.norm(limbs[:, None, None] - pixels[None], axis=3)
        ahead = scale > 0
        distance[frame][:, ahead] = gaps.min(axis=2)[:, ahead] * scale[ahead]
        centre = pixels.mean(axis=1)
        offset[frame] = (limbs[:, None] - centre[None]) * scale[None, :, None]
        nearest = np.linalg.norm(centre - frames.hips[frame], axis=1)
        per_px[frame] = scale[int(np.nanargmin(np.where(ahead, nearest, np.nan)))]
    distance = np.where(np.isfinite(distance), distance, np.inf)
    return Observations(distance, _limb_speeds(frames.times, offset), per_px)


def _limb_speeds(times: Floats, offset: Floats) -> Floats:
    """Return speeds, (F, 4, N) m/s, of offsets (F, 4, N, 2) m: the slower of before and after.

    A point that jumps away for a frame is fast in that frame alone, not in its neighbours.
    """
    steps = np.linalg.norm(np.diff(offset, axis=0), axis=3) / np.diff(times)[:, None, None]
    before = np.concatenate([steps[:1], steps])
    after = np.concatenate([steps, steps[-1:]])
    return np.nan_to_num(np.minimum(before, after), nan=0.0)


def runs_of(states: npt.NDArray[np.generic]) -> list[tuple[int, int]]:
    """Return the runs of equal values: the first frame of each and the frame after its last."""
    changes = (np.flatnonzero(states[1:] != states[:-1]) + 1).tolist()
    return list(zip([0, *changes], [*changes, len(states)], strict=True))
