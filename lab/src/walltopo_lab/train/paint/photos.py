"""Single photos of generated gyms in dim, mixed light, with true routes.

The generator's lamps share one colour, its walls are light, its paints far apart. Here a generated
gym has many narrow routes, each with one of nineteen paints, and every hold is faded individually.
The wall is darkened and often grey. Two or three sources of different colour (daylight from a side,
warm spots) fall off across the photo. The paint of one route therefore ranges from bright to nearly
black and from bluish to yellowish.

Each photo is one `.npz`: `photo` (683, 512, 3) uint8, `ids` (683, 512) int16 instances (0 = none),
and per instance `number`, `route` (-1 volume, -2 downclimb), `volume` and `colour`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.core.files import atomic_path
from walltopo.images.colour import linear_from_srgb8, srgb8_from_linear
from walltopo_lab.synth.bodies import GymInstance
from walltopo_lab.synth.develop import develop, draw_exposure
from walltopo_lab.synth.gym import Gym, make_gym
from walltopo_lab.synth.params import GymSettings, PhotoSettings, gym_preset
from walltopo_lab.synth.path import phone_camera, walk_poses
from walltopo_lab.synth.render import Renderer

Floats = NDArray[np.float64]
PER_GYM = 2
# Linear RGB of daylight through a window, and of neutral, warm and very warm lamps.
SOURCES = ((0.42, 0.85, 1.9), (1.0, 1.0, 1.0), (1.3, 0.98, 0.6), (1.6, 0.92, 0.35))

# Two sRGB shades of each paint of commercial holds (our reading of manufacturers' charts).
PAINTS = {
    "black": ((30, 30, 32), (45, 45, 48)),
    "grey": ((115, 118, 120), (140, 140, 142)),
    "white": ((235, 235, 230), (220, 222, 220)),
    "red": ((190, 25, 35), (215, 45, 40)),
    "orange": ((240, 110, 20), (245, 140, 40)),
    "yellow": ((250, 205, 20), (235, 190, 40)),
    "green": ((30, 130, 60), (60, 160, 80)),
    "lime": ((140, 195, 45), (165, 210, 70)),
    "mint": ((60, 185, 165), (90, 200, 175)),
    "sky": ((90, 170, 220), (120, 190, 225)),
    "blue": ((25, 75, 175), (45, 100, 195)),
    "purple": ((100, 50, 150), (130, 75, 170)),
    "pink": ((225, 70, 140), (240, 110, 165)),
    "wood": ((205, 165, 115), (185, 140, 95)),
}

# Additional paints close to those above, which make old gyms difficult.
OLD_PAINTS = {
    "beige": (205, 190, 165),
    "brown": (105, 75, 55),
    "maroon": (110, 40, 60),
    "dark green": (35, 80, 60),
    "slate": (95, 110, 130),
}


class DimPhoto:
    """One photo of a folder; the module docstring describes its arrays."""

    def __init__(self, path: Path) -> None:
        with np.load(path) as data:
            self.photo: NDArray[np.uint8] = data["photo"]
            self.ids: NDArray[np.int16] = data["ids"]
            self.number: list[int] = data["number"].tolist()
            self.route: list[int] = data["route"].tolist()
            self.volume: list[bool] = data["volume"].tolist()
            self.colour: list[str] = data["colour"].tolist()
        self.name = path.stem


def read_photos(folder: Path) -> list[DimPhoto]:
    """Return all photos of a folder, sorted by name."""
    return [DimPhoto(path) for path in sorted(folder.glob("*.npz"))]


def light_field(shape: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Return the (h, w, 3) linear light of two or three sources over a photo, mean 1."""
    height, width = shape
    y, x = np.indices(shape) / height
    total = np.full((*shape, 3), 0.04) * np.array(SOURCES[int(rng.integers(4))])
    for pick in rng.choice(4, int(rng.integers(2, 4)), replace=False):
        middle = rng.uniform(-0.3, 1.3, 2) * (1, width / height)
        reach = rng.uniform(0.2, 0.6)
        away = ((y - middle[0]) ** 2 + (x - middle[1]) ** 2) / reach**2
        total += (rng.uniform(0.4, 1.2) / (1 + away) ** 1.5)[..., None] * np.array(SOURCES[pick])
    return np.asarray(total / total.mean())


def _gym_settings(seed: int) -> tuple[GymSettings, PhotoSettings]:
    """Return settings of an old, dark gym or a modern one, with many routes and distant photos."""
    rng = np.random.default_rng([41, seed])
    gym, photo = gym_preset("oldschool-dark" if seed % 3 else "modern")
    gym = replace(
        gym,
        finish=("textured", "painted", "plywood")[seed % 3],
        width=6.5,
        routes=int(rng.integers(9, 20)),
        plates=0,
        light=0.5,
        detail=0.4,
        cell=0.05,
    )
    photo = replace(photo, photos=6, width=512, height=683, distance_low=3.5, distance_high=6.0)
    return gym, photo


def repaint(gym: Gym, seed: int) -> Gym:
    """Give each route a paint and each hold its own fading; three adjacent routes differ.

    Routes interleave: some holds change to the adjacent route.
    """
    rng = np.random.default_rng([43, seed])
    paints = {name: shades[int(rng.integers(2))] for name, shades in PAINTS.items()} | OLD_PAINTS
    names = rng.choice(list(paints), int(rng.integers(7, 12)), replace=False).tolist()
    given: dict[int, str] = {}
    for route in sorted({item.route for item in gym.instances if item.route >= 0}):
        recent = {given.get(route - 1), given.get(route - 2)}
        given[route] = str(rng.choice([name for name in names if name not in recent]))

    swapped = rng.uniform(0, 0.3)

    def painted(item: GymInstance) -> GymInstance:
        if item.route < 0:
            return item
        route = item.route + int(rng.choice((-1, 1)) if rng.random() < swapped else 0)
        route = route if route in given else item.route
        linear = linear_from_srgb8(np.array(paints[given[route]], dtype=np.uint8))
        faded = rng.beta(1.2, 6)
        linear = (linear * (1 - faded) + 0.4 * faded) * np.exp(rng.normal(0, 0.09, 3))
        linear = linear * np.exp(rng.normal(0, 0.15))
        red, green, blue = (srgb8_from_linear(linear) / 255).tolist()
        return replace(item, route=route, colour=given[route], rgb=(red, green, blue))

    return replace(gym, instances=[painted(item) for item in gym.instances])


def _photo(
    gym: Gym, renderer: Renderer, pose: Floats, photo: PhotoSettings, seed: list[int]
) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    linear, ids = renderer.render(phone_camera(photo), pose, photo.samples)
    wall = linear.mean(axis=2, keepdims=True) if rng.random() < 0.6 else linear
    linear = np.where(ids[..., None] > 0, linear, wall * rng.uniform(0.08, 1.0))
    lit = linear * light_field(ids.shape, rng)
    exposure = draw_exposure(photo, 0.4, rng)
    exposure = replace(exposure, gain=exposure.gain * rng.uniform(0.35, 1.0))
    pixels = develop(lit.astype(np.float32), exposure, rng)
    present = [item for item in gym.instances if np.count_nonzero(ids == item.id) >= 20]
    return {
        "photo": pixels,
        "ids": ids.astype(np.int16),
        "number": np.array([item.id for item in present]),
        "route": np.array([item.route for item in present]),
        "volume": np.array([item.label == "volume" for item in present]),
        "colour": np.array([item.colour for item in present]),
    }


def make_photos(folder: Path, first: int, count: int, progress: Progress) -> None:
    """Render `PER_GYM` photos of each of `count` gyms from `first`; existing photos are kept."""
    folder.mkdir(parents=True, exist_ok=True)
    progress.step("rendering gyms", count)
    for seed in range(first, first + count):
        if not all((folder / f"{seed}_{k}.npz").is_file() for k in range(PER_GYM)):
            _make_gym_photos(folder, seed)
        progress.advance()


def _make_gym_photos(folder: Path, seed: int) -> None:
    settings, photo = _gym_settings(seed)
    gym = make_gym(settings, seed)
    poses = walk_poses(gym.wall, [], settings, photo, np.random.default_rng([seed, 9]))
    gym = repaint(gym, seed)
    renderer = Renderer(gym)
    for k, pose in enumerate(poses[1 : 1 + 2 * PER_GYM : 2]):
        made = _photo(gym, renderer, pose, photo, [seed, k])
        with atomic_path(folder / f"{seed}_{k}.npz") as path, path.open("wb") as stream:
            np.savez_compressed(stream, **made)
