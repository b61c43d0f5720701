"""Procedural gyms with exact ground truth.

`make_gym(settings, seed)` builds a gym. `render_gym(gym, out, photos, seed)` photographs it into a
folder with its truth. `generate(out, recipe)` does both and resumes. `write_tiny_gym(out)` makes
the smallest gym for tests. Names are imported on first use, so this module is light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from walltopo_lab.synth.params import PRESETS, GymSettings, PhotoSettings, gym_preset

if TYPE_CHECKING:
    from walltopo_lab.synth.gym import Gym, Reset, make_gym
    from walltopo_lab.synth.recipe import Recipe, generate, render_gym
    from walltopo_lab.synth.small import tiny_recipe, write_tiny_gym

__all__ = [
    "PRESETS",
    "Gym",
    "GymSettings",
    "PhotoSettings",
    "Recipe",
    "Reset",
    "generate",
    "gym_preset",
    "make_gym",
    "render_gym",
    "write_tiny_gym",
    "tiny_recipe",
]

_HOMES = {
    "Gym": "gym",
    "Reset": "gym",
    "make_gym": "gym",
    "Recipe": "recipe",
    "generate": "recipe",
    "render_gym": "recipe",
    "write_tiny_gym": "small",
    "tiny_recipe": "small",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
