"""A clip of a climb on the tiny gym, small and read in some seconds."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

from benchmarks import clips

from walltopo_lab.synth.small import write_tiny_gym


def tiny_clip(out: Path) -> None:
    """Film a climb to the top of the route that the tiny scan numbers 2: `out`/clip.mp4."""
    write_tiny_gym(out / "gym")
    with patch.object(clips, "SIZE", (360, 640)):
        [filmed] = clips.film(out / "gym", out, 1)
    filmed.video.rename(out / "clip.mp4")
