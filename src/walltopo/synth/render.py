"""One photo of a gym: rays through the distorted lens, shaded and averaged per pixel."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.synth.gym import Gym
from walltopo.synth.palette import DOWNCLIMB_GREY
from walltopo.synth.shade import distorted_rays, noise_table, shade

__all__ = ["Renderer"]

_ROWS = 32  # rows of a band: small enough for the cache, large enough for Embree


@cache
def _linear_of_srgb() -> NDArray[np.float32]:
    """(256,) linear light of sRGB bytes."""
    s = np.arange(256) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4).astype(np.float32)


class Renderer:
    """Renders photos of one gym; two bands at a time (Embree holds the GIL, shading does not)."""

    def __init__(self, gym: Gym, threads: int = 2) -> None:
        self.gym = gym
        self.threads = threads
        count = max((i.id for i in gym.instances), default=0) + 1
        self._rgb = np.full((count, 3), 0.2, np.float64)
        self._gloss = np.ones(count)
        self._shifts = np.zeros(count)
        rng = np.random.default_rng([gym.seed, 8])
        for item in gym.instances:
            srgb = np.asarray(item.rgb if item.rgb else DOWNCLIMB_GREY)
            self._rgb[item.id] = np.where(
                srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4
            )
            self._gloss[item.id] = rng.uniform(0.4, 1.6)
            self._shifts[item.id] = rng.uniform(0, 200)
        self._table = noise_table()

    def render(
        self, camera: Camera, cam_from_world: NDArray[np.float64], samples: int
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Linear radiance (H, W, 3) and the instance most samples of each pixel see (H, W)."""
        image = np.zeros((camera.height, camera.width, 3), np.float32)
        ids = np.zeros((camera.height, camera.width), np.int32)
        bands = range(0, camera.height, _ROWS)
        with ThreadPoolExecutor(self.threads) as pool:
            jobs = [
                pool.submit(self._band, camera, cam_from_world, y, samples, image, ids)
                for y in bands
            ]
            for job in jobs:
                job.result()
        return image, ids

    def _band(
        self,
        camera: Camera,
        pose: NDArray[np.float64],
        y0: int,
        samples: int,
        image: NDArray[np.float32],
        ids: NDArray[np.int32],
    ) -> None:
        y1 = min(y0 + _ROWS, camera.height)
        rotation = np.ascontiguousarray(pose[:, :3])
        centre = -rotation.T @ pose[:, 3]
        k1 = camera.distortion[0] if camera.distortion else 0.0
        way = distorted_rays(
            y0, y1, camera.width, samples, camera.fx, camera.cx, camera.cy, k1, rotation
        )
        origins = np.broadcast_to(centre.astype(np.float32), way.shape)
        hit = self.gym.tracer.hits(np.ascontiguousarray(origins), way)
        band_ids = np.zeros(len(way), np.int32)
        s, a, b = self.gym.surface, self.gym.atlas, self.gym.baked
        flat = np.zeros(((y1 - y0) * camera.width, 3), np.float32)
        shade(
            hit["primID"], hit["u"], hit["v"], hit["tfar"], way, centre, samples * samples,
            1.0 / camera.fx,
            s.faces, s.face_facet, s.face_instance, s.vertices, s.normals, s.own, s.marks,
            b.irradiance, b.towards, a.texels, a.levels, a.charts, _linear_of_srgb(),
            self._rgb, self._gloss, self._shifts, self._table,
            0.45 + 0.65 * self.gym.settings.chalk, 0.004, flat, band_ids,
        )  # fmt: skip
        image[y0:y1] = flat.reshape(y1 - y0, camera.width, 3)
        votes = band_ids.reshape(y1 - y0, camera.width, samples * samples)
        ids[y0:y1] = _majority(votes)


def _majority(votes: NDArray[np.int32]) -> NDArray[np.int32]:
    """The commonest of the last axis (the first of equals)."""
    counts = (votes[..., :, None] == votes[..., None, :]).sum(axis=-1)
    best = counts.argmax(axis=-1)
    return np.take_along_axis(votes, best[..., None], axis=-1)[..., 0]
