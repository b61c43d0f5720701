"""Clips of climbers on a generated gym, each with its truth.

A jointed body with clothes climbs routes
as the movement model climbs them. Two phones of three stand, the third is held by a hand; every
second climb ends in a fall; through every fourth clip somebody walks.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress, Silent
from walltopo_climb.movement.body import BODIES
from walltopo_lab.synth.climbs import TrueClimb, TrueWall, climb_route, read_true_wall
from walltopo_lab.synth.clip import Climber, Passer, Phone, film_climb, phone_path
from walltopo_lab.synth.develop import draw_exposure
from walltopo_lab.synth.filmed import ContactTruth, FilmedClip, pinhole
from walltopo_lab.synth.gym import make_gym
from walltopo_lab.synth.mannequin import draw_clothes
from walltopo_lab.synth.performance import TrueContact
from walltopo_lab.synth.recipe import read_recipe
from walltopo_lab.synth.render import Renderer

Floats = NDArray[np.float64]

SIZE = (720, 1280)
_TRIES = 8  # climbs drawn for each clip that is wanted


def film_gym(
    gym: Path,
    out: Path,
    count: int,
    size: tuple[int, int] = SIZE,
    progress: Progress | None = None,
) -> Iterator[tuple[Path, FilmedClip]]:
    """Yield `count` clips of a gym's routes and their truths, filmed into a folder.

    A clip that is in the folder already is not filmed again.

    Parameters
    ----------
    gym : a folder of `walltopo synth`, without reset and scanned holds.
    size : width and height, pixels.

    Raises
    ------
    InputError : the folder is not such a gym, or its routes have too few moves.
    """
    progress = progress or Silent()
    studio = _Studio(gym, size)
    progress.step("filming", count)
    made = 0
    for number in range(_TRIES * count):
        if made == count:
            return
        video, truth = out / f"{number}.mp4", out / f"{number}.json"
        if not (video.is_file() and truth.is_file()):
            filmed = studio.film(number, video)
            if filmed is None:
                continue
            filmed.save(truth)
        made += 1
        progress.advance()
        yield video, FilmedClip.load(truth)
    if made < count:
        raise InputError(f"{gym}: its routes give {made} clips of {count} wanted")


class _Studio:
    """A gym with its true wall; the renderer is made for the first clip."""

    def __init__(self, gym: Path, size: tuple[int, int]) -> None:
        self.size = size
        self.wall: TrueWall = read_true_wall(gym)
        self.recipe = read_recipe(gym)
        self._renderer: Renderer | None = None

    @property
    def renderer(self) -> Renderer:
        if self._renderer is None:
            self._renderer = Renderer(make_gym(self.recipe.gym, self.recipe.seed))
        return self._renderer

    def film(self, number: int, video: Path) -> FilmedClip | None:
        """Write a clip and return its truth, None if this body climbs too little of the route."""
        rng = np.random.default_rng([self.recipe.seed, number])
        route = self.wall.routes[number % len(self.wall.routes)]
        names = list(BODIES)
        name = names[(number // len(self.wall.routes) + number) % len(names)]
        climb = climb_route(self.wall, route, BODIES[name], rng, falls=bool(number % 2))
        if climb is None:
            return None
        handheld, passes = number % 3 == 2, number % 4 == 1
        phone = self._phone(climb, rng, handheld=handheld)
        climber = Climber(BODIES[name], draw_clothes(rng), climb.outward, climb.performance)
        passer = _make_passer(climb, phone, rng) if passes else None
        samples = 1 if handheld else 2
        film_climb(video, self.renderer, climber, phone, rng, samples, passer)
        return FilmedClip(
            route=route.id,
            body=name,
            is_topped=climb.is_topped,
            is_handheld=handheld,
            has_passer=passes,
            length=float(climb.performance.times[-1]),
            width=phone.camera.width,
            height=phone.camera.height,
            focal=phone.camera.fx,
            cam_from_world=phone.cam_from_world.tolist(),
            contacts=tuple(map(_contact, climb.contacts)),
        )

    def _phone(self, climb: TrueClimb, rng: np.random.Generator, *, handheld: bool) -> Phone:
        """Return a phone some metres before the wall, at the height of a hand."""
        performance = climb.performance
        level = climb.outward * [1, 1, 0] / np.linalg.norm(climb.outward[:2])
        middle = performance.hips.mean(axis=0)
        eye = middle + rng.uniform(3.2, 5.0) * level
        eye += rng.uniform(-1.2, 1.2) * np.array([-level[1], level[0], 0])
        eye[2] = rng.uniform(1.2, 1.7)
        return Phone(
            pinhole(*self.size, float(rng.uniform(0.7, 0.9) * max(self.size))),
            phone_path(eye, middle, len(performance.times), rng, handheld=handheld),
            draw_exposure(self.recipe.photos, self.renderer.gym.settings.light, rng),
        )


def _contact(one: TrueContact) -> ContactTruth:
    return ContactTruth(one.limb, one.hold, one.begin, one.end)


def _make_passer(climb: TrueClimb, phone: Phone, rng: np.random.Generator) -> Passer:
    """Return somebody who walks between phone and wall, once through the picture."""
    times = climb.performance.times
    eye = -phone.cam_from_world[0, :, :3].T @ phone.cam_from_world[0, :, 3]
    middle = climb.performance.hips.mean(axis=0)
    across = np.cross((middle - eye) * [1, 1, 0], [0.0, 0.0, 1.0])
    across *= rng.choice([-1.0, 1.0]) / np.linalg.norm(across)
    place = (eye + rng.uniform(0.5, 0.7) * (middle - eye)) * [1, 1, 0]
    when = rng.uniform(0.3, 0.7) * times[-1]
    body = BODIES[str(rng.choice(list(BODIES)))]
    return Passer(body, draw_clothes(rng), place, across, float(when))
