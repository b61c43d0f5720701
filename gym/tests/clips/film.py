"""A clip of a climb on the tiny gym, small and read in some seconds."""

from __future__ import annotations

from pathlib import Path

from walltopo_lab.synth.film import film_gym
from walltopo_lab.synth.small import write_tiny_gym


def tiny_clip(out: Path) -> None:
    """Film a climb to the top of the route that the tiny scan numbers 2: `out`/clip.mp4."""
    gym = write_tiny_gym(out / "gym")
    [(video, _)] = film_gym(gym, out, 1, size=(450, 800))
    video.rename(out / "clip.mp4")
