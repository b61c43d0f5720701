"""The film of a clip: without sound, and without people who do not climb."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from climb.tests.beta.videos import write_video
from numpy.typing import NDArray

from walltopo.core import Camera
from walltopo.images.people import Person
from walltopo.reconstruct.ingest.video import LongVideoError, timed_frames
from walltopo_climb.beta import film
from walltopo_climb.beta.film import write_film
from walltopo_climb.beta.in_view import Frames

WIDTH, HEIGHT = 160, 120
CLIMBER, PASSER = (20, 20, 60, 110), (100, 30, 150, 119)


def frames_of_climber(count: int) -> Frames:
    """The climber's limbs in the corners of its box."""
    x0, y0, x1, y1 = CLIMBER
    corners = np.array([[x0, y0], [x1, y0], [x0, y1], [x1, y1]], np.float64)
    pose = np.eye(4)[None, :3].repeat(count, axis=0)
    camera = Camera("SIMPLE_PINHOLE", WIDTH, HEIGHT, (100.0, WIDTH / 2, HEIGHT / 2))
    return Frames(
        np.arange(count) / 10,
        corners[None].repeat(count, axis=0),
        np.ones((count, 4)),
        np.full((count, 2), 50.0),
        camera,
        pose,
    )


def picture(passer: bool) -> NDArray[np.uint8]:
    pixels = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    for (x0, y0, x1, y1), shade in ((CLIMBER, 250), (PASSER, 0)):
        if shade or passer:
            pixels[y0:y1, x0:x1] = shade
    return pixels


def find_boxes(pixels: NDArray[np.uint8]) -> list[Person]:
    """Boxes of both, as far as their shades are there."""
    found = []
    for box, is_there in ((CLIMBER, pixels[60, 40, 0] > 200), (PASSER, pixels[60, 125, 0] < 50)):
        if is_there:
            found.append(Person(tuple(map(float, box)), 0.9))  # type: ignore[arg-type]
    return found


def test_others_are_hidden_some_time_before_and_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "find_people", find_boxes)
    clip = write_video(tmp_path / "clip.mp4", ((k / 25, picture(50 <= k < 75)) for k in range(125)))
    out = tmp_path / "film.mp4"
    write_film(clip, out, frames_of_climber(50))
    shown = dict(timed_frames(out, 25.0, 60.0, 1280))
    assert len(shown) == 125
    for pixels in shown.values():
        assert pixels[60, 40, 0] > 230  # the climber
        assert pixels[60, 125, 0] > 90  # nobody stands here in any frame
    with av.open(str(out)) as container:
        assert not container.streams.audio
        assert "creation_time" not in container.metadata


def test_a_picture_with_odd_sides_and_nobody_else_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "SIDE", 159)  # reduces to odd sides
    monkeypatch.setattr(film, "find_people", find_boxes)
    clip = write_video(tmp_path / "clip.mp4", ((k / 25, picture(False)) for k in range(30)))
    write_film(clip, tmp_path / "film.mp4", frames_of_climber(12))
    [*times] = dict(timed_frames(tmp_path / "film.mp4", 25.0, 60.0, 1280))
    assert times == pytest.approx([k / 25 for k in range(30)], abs=2e-3)


def test_a_clip_that_is_too_long_leaves_no_film(tmp_path: Path) -> None:
    clip = write_video(tmp_path / "clip.mp4", ((k / 5, picture(False)) for k in range(20)))
    with pytest.raises(LongVideoError):
        write_film(clip, tmp_path / "film.mp4", frames_of_climber(12), max_seconds=2.0)
    assert not (tmp_path / "film.mp4").exists()
