"""Film a body that climbs a route of a generated gym, as a video with exact contacts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.core.files import atomic_path
from walltopo_climb.movement.body import Body
from walltopo_lab.synth.develop import Exposure, develop
from walltopo_lab.synth.mannequin import Clothes, draw_body, parts_of, skeleton_of
from walltopo_lab.synth.path import look_at
from walltopo_lab.synth.performance import Performance, right_of
from walltopo_lab.synth.render import Renderer

Floats = NDArray[np.float64]

_BODY_LIGHT: Final = 0.55  # radiance of a white surface, in those of the brighter part of the wall
_BIT_RATE: Final = 6_000_000
_DRIFT_M: Final = 0.004  # of a hand-held phone from frame to frame, standard deviation


@dataclass(frozen=True)
class Phone:
    """A phone that films.

    Parameters
    ----------
    camera : without distortion. cam_from_world : (F, 3, 4), of each frame; equal if it stands.
    exposure : of all frames.
    """

    camera: Camera
    cam_from_world: Floats
    exposure: Exposure

    @property
    def stands(self) -> bool:
        """Return whether all poses are equal."""
        return bool((self.cam_from_world == self.cam_from_world[:1]).all())


@dataclass(frozen=True)
class Climber:
    """A body in the clip: its limbs over time, size, looks, and the wall's outward direction."""

    performance: Performance
    body: Body
    clothes: Clothes
    out: Floats


def phone_path(
    eye: Floats, target: Floats, count: int, rng: np.random.Generator, *, handheld: bool
) -> Floats:
    """Return (count, 3, 4) poses of a phone that stands, or that a hand holds."""
    steps = rng.normal(0, _DRIFT_M if handheld else 0.0, (2, count, 3))
    moves = np.cumsum(steps, axis=1) * 0.97 ** np.arange(count)[None, ::-1, None]
    return np.array(
        [look_at(eye + move, target + 2 * sway, 0.0) for move, sway in zip(*moves, strict=True)]
    )


def film_climb(
    path: Path,
    renderer: Renderer,
    climber: Climber,
    phone: Phone,
    rng: np.random.Generator,
    samples: int = 2,
) -> None:
    """Write an H.264 video of a climb, one frame for each time of the performance.

    Parameters
    ----------
    path : ends with .mp4. samples : rays of a pixel, a side.
    """
    import av

    times = climber.performance.times
    rate = round(1 / float(times[1] - times[0]))
    with atomic_path(path) as temporary, av.open(str(temporary), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.width, stream.height = phone.camera.width, phone.camera.height
        stream.pix_fmt, stream.bit_rate = "yuv420p", _BIT_RATE
        wall, stands = None, phone.stands
        for number in range(len(times)):
            pose = phone.cam_from_world[number]
            if wall is None or not stands:
                wall, _ = renderer.render(phone.camera, pose, samples)
            picture = wall.copy()
            _draw(picture, climber, phone.camera, pose, number)
            frame = av.VideoFrame.from_ndarray(develop(picture, phone.exposure, rng), "rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _draw(
    picture: NDArray[np.float32], climber: Climber, camera: Camera, pose: Floats, number: int
) -> None:
    performance = climber.performance
    limbs, hips = performance.limbs[number], performance.hips[number]
    bones = skeleton_of(limbs, hips, climber.body, climber.out, right_of(climber.out))
    parts, colours = parts_of(bones, climber.body, climber.clothes, climber.out)
    light = float(np.percentile(picture[::8, ::8], 90)) / _BODY_LIGHT
    draw_body(picture, camera, pose, parts, colours, light)
