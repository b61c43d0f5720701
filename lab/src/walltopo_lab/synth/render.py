"""Rendering of a gym's photos: rays through the distorted lens, shaded and averaged per pixel."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.images.colour import linear32_from_srgb8, linear_from_srgb
from walltopo_lab.synth.gym import Gym
from walltopo_lab.synth.shade import (
    Bitmaps,
    Finish,
    Hits,
    Shell,
    distorted_rays,
    noise_table,
    shade,
)
from walltopo_lab.synth.two_colours import second_parts

_ROWS = 32  # rows of a band: small enough for the cache, large enough for Embree
_FOG = 0.004  # share of light that dust in the air absorbs, per metre


def _finish_of(gym: Gym) -> Finish:
    """Return the colours and the surface of every instance; each has its own random stream."""
    count = max((item.id for item in gym.instances), default=0) + 1
    rgb, gloss, grain = np.zeros((count, 3)), np.ones(count), np.ones(count)
    shifts, screws = np.zeros(count), np.full((count, 2, 2), 9.0)  # 9 m away: no screw
    second = np.zeros((count, 3))
    plane, on_slick = second_parts(gym.instances)
    for item in gym.instances:
        rng = np.random.default_rng([gym.seed, 8, item.id])
        rgb[item.id] = linear_from_srgb(np.asarray(item.rgb))
        gloss[item.id], grain[item.id] = rng.uniform(0.4, 1.6), rng.uniform(0.4, 1.7)
        shifts[item.id] = rng.uniform(0, 200)
        if item.second is not None:
            second[item.id] = linear_from_srgb(np.asarray(item.second.rgb))
        if item.body is not None and item.body.radius > 0.06:
            screws[item.id] = rng.uniform(-0.6, 0.6, (2, 2)) * item.body.radius
    chalk = 0.45 + 0.65 * gym.settings.chalk
    return Finish(
        rgb,
        second,
        plane,
        on_slick.astype(np.float64),
        gloss,
        grain,
        screws,
        shifts,
        noise_table(),
        chalk,
    )


class Renderer:
    """A renderer of one gym; two bands run at a time (Embree holds the GIL, shading does not)."""

    def __init__(self, gym: Gym, threads: int = 2) -> None:
        self.gym = gym
        self.threads = threads
        s, a, b = gym.surface, gym.atlas, gym.baked
        self._shell = Shell(
            s.faces,
            s.face_facet,
            s.face_instance,
            s.normals,
            s.own,
            s.marks,
            b.irradiance,
            b.towards,
        )
        self._bitmaps = Bitmaps(
            a.texels, a.levels, a.charts, linear32_from_srgb8(np.arange(256, dtype=np.uint8))
        )
        self._finish = _finish_of(gym)

    def render(
        self, camera: Camera, cam_from_world: NDArray[np.float64], samples: int
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return linear radiance (H, W, 3) and the most frequent instance of each pixel (H, W)."""
        image = np.zeros((camera.height, camera.width, 3), np.float32)
        ids = np.zeros((camera.height, camera.width), np.int32)
        with ThreadPoolExecutor(self.threads) as pool:
            jobs = [
                pool.submit(self._band, camera, cam_from_world, y, samples, image, ids)
                for y in range(0, camera.height, _ROWS)
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
        """Render rows y0 .. y0 + _ROWS into `image` and `ids`."""
        y1 = min(y0 + _ROWS, camera.height)
        rotation = np.ascontiguousarray(pose[:, :3])
        centre = -rotation.T @ pose[:, 3]
        k1 = camera.distortion[0] if camera.distortion else 0.0
        way = distorted_rays(
            y0, y1, camera.width, samples, camera.fx, camera.cx, camera.cy, k1, rotation
        )
        origins = np.tile(centre.astype(np.float32), (len(way), 1))
        hit = self.gym.tracer.hits(origins, way)
        hits = Hits(hit["primID"], hit["u"], hit["v"], hit["tfar"], way)
        band_ids = np.zeros(len(way), np.int32)
        flat = np.zeros(((y1 - y0) * camera.width, 3), np.float32)
        shade(
            hits,
            centre,
            samples * samples,
            1.0 / camera.fx,
            _FOG,
            self._shell,
            self._bitmaps,
            self._finish,
            flat,
            band_ids,
        )
        image[y0:y1] = flat.reshape(y1 - y0, camera.width, 3)
        ids[y0:y1] = _majority_vote(band_ids.reshape(y1 - y0, camera.width, samples * samples))


def _majority_vote(votes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the most frequent value along the last axis (the first of equals)."""
    counts = (votes[..., :, None] == votes[..., None, :]).sum(axis=-1)
    best = counts.argmax(axis=-1)
    return np.take_along_axis(votes, best[..., None], axis=-1)[..., 0]
