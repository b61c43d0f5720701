"""The smallest gym that still reconstructs, for tests of the stages after the photos."""

from __future__ import annotations

from pathlib import Path

from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate


def tiny_recipe(photos: int = 8, size: tuple[int, int] = (480, 360), seed: int = 0) -> Recipe:
    """Return the recipe of a wall of 2.4 x 2.2 m with two routes, a volume and a scale plate."""
    gym = GymSettings(
        width=2.4,
        height=2.2,
        columns=3,
        overhang_min_deg=0.0,
        overhang_max_deg=15.0,
        facets=0.6,
        volumes=1,
        routes=2,
        holds_low=4,
        holds_high=5,
        downclimb=0,
        hold_scale=1.15,
        lamps=2,
        wear=0.9,
        chalk=0.6,
        cell=0.04,
        detail=0.5,
    )
    camera = PhotoSettings(
        photos=photos,
        width=size[0],
        height=size[1],
        distance_low=1.8,
        distance_high=2.2,
        measure_share=0.4,
        exposure_spread=0.05,
        blur_px=0.0,
        noise=0.4,
        roll_deg=2.0,
        quality=94,
    )
    return Recipe(gym, camera, seed, preset="tiny")


def write_tiny_gym(
    out: Path, photos: int = 8, size: tuple[int, int] = (480, 360), seed: int = 0
) -> Path:
    """Write the tiny gym with its exact truth (`out`/photos, `out`/truth); return `out`.

    `truth/masks.json` contains perfect masks of every photo. The call takes a few seconds.
    """
    generate(Path(out), tiny_recipe(photos, size, seed))
    return Path(out)
