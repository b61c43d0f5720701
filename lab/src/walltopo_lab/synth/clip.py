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
_SHUTTER_S: Final = 0.02
_BLUR_PX: Final = 1.0  # a limb that moves less while the shutter is open is drawn once
_EXPOSURES: Final = 3  # pictures of a moving body that make a frame
_WALK: Final = 1.2  # m/s
_STEP_S: Final = 1.0  # two steps


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
class Dressed:
    """A body's size and looks. `out` : (3,) unit vector, away from where it faces."""

    body: Body
    clothes: Clothes
    out: Floats


@dataclass(frozen=True)
class Climber(Dressed):
    """A body that climbs; it faces the wall."""

    performance: Performance


@dataclass(frozen=True)
class Passer:
    """Somebody who walks through the clip.

    Parameters
    ----------
    place : (3,) m on the floor, at `when` (s). direction : (3,) unit vector, level.
    """

    body: Body
    clothes: Clothes
    place: Floats
    direction: Floats
    when: float

    def limbs_at(self, time: float) -> tuple[Floats, Floats]:
        """Return (4, 3) limbs and (3,) hips, m."""
        ahead, side = self.direction, right_of(-self.direction)
        base = self.place + _WALK * (time - self.when) * ahead
        hips = base + [0.0, 0.0, 0.98 * self.body.leg]
        phase = 2 * np.pi * time / _STEP_S
        limbs = []
        for sign in (-1, 1):
            swing = -sign * 0.25 * np.sin(phase) * ahead
            limbs.append(hips + sign * 0.27 * side + swing + [0.0, 0.0, -0.1])
        for sign in (-1, 1):
            lift = max(sign * np.cos(phase), 0.0) * np.array([0.0, 0.0, 0.12])
            limbs.append(base + sign * 0.1 * side + sign * 0.3 * np.sin(phase) * ahead + lift)
        return np.array(limbs), hips


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
    passer: Passer | None = None,
) -> None:
    """Write an H.264 video of a climb, one frame for each time of the performance.

    Parameters
    ----------
    path : ends with .mp4. samples : rays of a pixel, a side.
    passer : walks between the phone and the climber.
    """
    import av

    times = climber.performance.times
    rate = round(1 / float(times[1] - times[0]))
    with atomic_path(path) as temporary, av.open(str(temporary), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.width, stream.height = phone.camera.width, phone.camera.height
        stream.pix_fmt, stream.bit_rate = "yuv420p", _BIT_RATE
        wall, stands = None, phone.stands
        for number, time in enumerate(times):
            pose = phone.cam_from_world[number]
            if wall is None or not stands:
                wall, _ = renderer.render(phone.camera, pose, samples)
            picture = _with_climber(wall, climber, phone, number)
            if passer is not None:
                limbs, hips = passer.limbs_at(float(time))
                dressed = Dressed(passer.body, passer.clothes, -passer.direction)
                _draw(picture, dressed, limbs, hips, phone.camera, pose)
            frame = av.VideoFrame.from_ndarray(develop(picture, phone.exposure, rng), "rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _with_climber(
    wall: NDArray[np.float32], climber: Climber, phone: Phone, number: int
) -> NDArray[np.float32]:
    """Return a frame with the climber, blurred by what moves while the shutter is open."""
    performance, pose = climber.performance, phone.cam_from_world[number]
    after = min(number + 1, len(performance.times) - 1)
    share = _SHUTTER_S / float(performance.times[1] - performance.times[0])
    limbs, hips = performance.limbs[number], performance.hips[number]
    further = share * (performance.limbs[after] - limbs)
    further_hips = share * (performance.hips[after] - hips)
    begin, end = (
        phone.camera.project(places @ pose[:, :3].T + pose[:, 3])
        for places in (limbs, limbs + further)
    )
    moves = np.linalg.norm(end - begin, axis=1).max() > _BLUR_PX
    exposures = _EXPOSURES if moves else 1
    total = np.zeros_like(wall)
    for part in np.linspace(0, 1, exposures):
        picture = wall.copy()
        at, hips_at = limbs + part * further, hips + part * further_hips
        _draw(picture, climber, at, hips_at, phone.camera, pose)
        total += picture
    return total / np.float32(exposures)


def _draw(
    picture: NDArray[np.float32],
    dressed: Dressed,
    limbs: Floats,
    hips: Floats,
    camera: Camera,
    pose: Floats,
) -> None:
    bones = skeleton_of(limbs, hips, dressed.body, dressed.out, right_of(dressed.out))
    parts, colours = parts_of(bones, dressed.body, dressed.clothes, dressed.out)
    light = float(np.percentile(picture[::8, ::8], 90)) / _BODY_LIGHT
    draw_body(picture, camera, pose, parts, colours, light)
