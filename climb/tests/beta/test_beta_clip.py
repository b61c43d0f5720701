"""Clips that cannot be read say why; frames come by the time of the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from climb.tests.beta.videos import write_video
from numpy.typing import NDArray

from walltopo.cli import main
from walltopo.core import InputError
from walltopo.reconstruct.ingest.video import timed_frames
from walltopo.scans.folder import ScanFolder
from walltopo_climb.beta.clip import read_clip
from walltopo_climb.beta.refusal import ClipError
from walltopo_climb.beta.scanned_wall import ScannedWall

Image = NDArray[np.uint8]


@pytest.fixture(scope="module")
def wall(tiny_scan: Path) -> ScannedWall:
    return ScannedWall.load(ScanFolder(tiny_scan))


@pytest.fixture(scope="module")
def photo(tiny_scan: Path) -> Image:
    folder = ScanFolder(tiny_scan)
    name = ScanFolder.sparse.load(folder).views[0].name
    return ScanFolder.photos.load(folder).read_rgb(name)


def grey(level: int) -> Image:
    return np.full((120, 160, 3), level, np.uint8)


def test_frames_come_by_the_time_of_the_file(tmp_path: Path) -> None:
    # A phone that drops frames: 60 a second, then 4 a second.
    times = [k / 60 for k in range(120)] + [2 + k / 4 for k in range(8)]
    path = write_video(tmp_path / "a.mp4", ((time, grey(90)) for time in times))
    found = [time for time, _ in timed_frames(path, 10.0, 60.0, 1280)]
    early = [time for time in found if time < 2]
    assert len(early) == pytest.approx(20, abs=1)
    assert np.diff(early) == pytest.approx(0.1, abs=0.02)
    assert [time for time in found if time >= 2] == pytest.approx(times[120:], abs=0.01)


def test_large_frames_are_reduced(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mp4", [(0.0, np.zeros((480, 640, 3), np.uint8))])
    ((_, frame),) = timed_frames(path, 10.0, 60.0, 320)
    assert frame.shape == (240, 320, 3)


def test_a_long_clip_is_refused(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mp4", ((k / 2, grey(90)) for k in range(20)))
    with pytest.raises(InputError, match="is longer than 5 seconds"):
        list(timed_frames(path, 10.0, 5.0, 1280))


def test_a_file_that_is_not_a_clip_is_refused(wall: ScannedWall, tmp_path: Path) -> None:
    text = tmp_path / "notes.mp4"
    text.write_text("not a video")
    with pytest.raises(InputError, match=r"notes\.mp4: cannot be decoded as a video"):
        read_clip(text, wall)
    with pytest.raises(InputError, match=r"missing\.mp4: cannot be decoded"):
        read_clip(tmp_path / "missing.mp4", wall)
    short = write_video(tmp_path / "short.mp4", [(k / 10, grey(k)) for k in range(3)])
    with pytest.raises(InputError, match="too short for an attempt"):
        read_clip(short, wall)
    with pytest.raises(InputError, match="the wall has no route 99"):
        read_clip(short, wall, route=99)


def test_a_clip_of_something_else_is_refused(wall: ScannedWall, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    frames = [(k / 10, rng.integers(0, 255, (240, 320, 3)).astype(np.uint8)) for k in range(12)]
    with pytest.raises(ClipError, match="does not show this wall") as raised:
        read_clip(write_video(tmp_path / "other.mp4", frames), wall)
    assert raised.value.fault == "other-wall"
    with pytest.raises(ClipError, match=r"other\.mp4: is longer than 1 seconds") as raised:
        read_clip(tmp_path / "other.mp4", wall, max_seconds=0.6)
    assert raised.value.fault == "too-long"


def test_a_clip_without_a_climber_is_refused(
    wall: ScannedWall, photo: Image, tiny_scan: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    large = np.repeat(np.repeat(photo, 2, axis=0), 2, axis=1)
    path = write_video(tmp_path / "empty.mp4", [(k / 10, large) for k in range(12)])
    with pytest.raises(InputError, match=r"empty\.mp4: no frame shows a climber"):
        read_clip(path, wall)
    out = tmp_path / "attempt.json"
    assert main(["beta", str(path), "--scan", str(tiny_scan), "-o", str(out)]) != 0
    assert "no frame shows a climber" in capsys.readouterr().err.replace("\n", " ")
    assert not out.exists()


def test_holds_behind_the_wall_are_not_in_view(wall: ScannedWall) -> None:
    front = np.array(wall.holds[0].position) + 3 * np.array(wall.holds[0].normal)
    seen = wall.holds_seen_from(front / wall.unit)
    assert wall.holds[0].id in seen.ids
    behind = np.array(wall.holds[0].position) - 10 * np.array(wall.holds[0].normal)
    with pytest.raises(InputError, match="no hold of the wall is in the picture"):
        wall.holds_seen_from(behind / wall.unit)
