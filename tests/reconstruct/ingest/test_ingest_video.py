"""Films: the same frames whatever their number, none kept in memory, and nothing left unsaid."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise
from pathlib import Path

import pytest
from made_files import ingested, skipped_reasons, write_film, write_photos  # type: ignore[import-not-found]

from walltopo.reconstruct.ingest.decoding import MemoryBudget, StoredPhoto
from walltopo.reconstruct.ingest.store import _EvenlySpread, store_file
from walltopo.reconstruct.ingest.video import sharpest_frames
from walltopo.reconstruct.settings import IngestSettings


def test_frames_follow_the_motion(tmp_path: Path) -> None:
    write_film(tmp_path / "walk.mp4", 120)
    scan = ingested(tmp_path, tmp_path / "walk.mp4")
    frames = sorted(p.name for p in scan.photos.iterdir())
    # 1920 px of motion in 640 px wide frames, a frame every 8 % of the width or per look.
    assert 10 <= len(frames) <= 40
    assert all(name.startswith("walk_") for name in frames)


def test_a_text_file_is_no_video(tmp_path: Path) -> None:
    write_photos(tmp_path / "in")
    (tmp_path / "in" / "film.mp4").write_text("no film")
    reasons = skipped_reasons(ingested(tmp_path, tmp_path / "in"))
    assert "cannot be decoded" in reasons["film.mp4"]


def test_a_film_without_frames_is_reported(tmp_path: Path) -> None:
    """Its index is there, its pictures are not: FFmpeg opens it and finds none."""
    write_photos(tmp_path / "in")
    film = tmp_path / "in" / "empty.mp4"
    write_film(film, 3)
    data = film.read_bytes()
    start = data.index(b"mdat") + 4
    size = int.from_bytes(data[start - 8 : start - 4], "big") - 8
    film.write_bytes(data[:start] + bytes(size) + data[start + size :])
    reasons = skipped_reasons(ingested(tmp_path, tmp_path / "in"))
    assert reasons.keys() == {"empty.mp4"}


def test_no_frames_and_no_error_is_reported_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("walltopo.reconstruct.ingest.video._decode", lambda *_: iter(()))
    write_film(tmp_path / "walk.mp4", 3)
    done = store_file(0, tmp_path / "walk.mp4", tmp_path, IngestSettings(), MemoryBudget())
    assert done.reasons == ("has no frames",)


def test_frames_of_two_films_of_one_name_are_distinguished(tmp_path: Path) -> None:
    for name, step in (("a", 16), ("b", 24)):
        (tmp_path / name).mkdir()
        write_film(tmp_path / name / "my.walk.mp4", 40, step=step)
    scan = ingested(tmp_path, tmp_path / "a", tmp_path / "b")
    names = [file.name for file in scan.photos.iterdir()]
    assert all(name.startswith("my.walk_0") for name in names)


def test_a_film_beyond_the_longest_is_read_up_to_it_and_that_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("walltopo.reconstruct.ingest.video._MAX_SAMPLES", 10)
    write_film(tmp_path / "walk.mp4", 90)
    done = store_file(0, tmp_path / "walk.mp4", tmp_path, IngestSettings(), MemoryBudget())
    assert done.reasons == ("only its first 30 minutes were looked at",)
    assert done.photos
    assert max(stored.frame or 0 for stored in done.photos) < 50


def test_frames_beyond_what_a_phone_films_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("walltopo.reconstruct.ingest.video._MAX_FRAME_PIXELS", 1000)
    write_film(tmp_path / "walk.mp4", 5)
    done = store_file(0, tmp_path / "walk.mp4", tmp_path, IngestSettings(), MemoryBudget())
    assert "too large to be a phone's video" in done.reasons[0]


@pytest.mark.slow
def test_memory_does_not_grow_with_the_film(tmp_path: Path) -> None:
    """NumPy tells tracemalloc what its arrays take."""
    write_film(tmp_path / "walk.mp4", 300, step=40)
    tracemalloc.start()
    try:
        frames = sum(1 for _ in sharpest_frames(tmp_path / "walk.mp4", MemoryBudget(), []))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert frames >= 30
    assert peak < 8 * 640 * 480 * 3


@pytest.mark.parametrize("frames", [3, 10, 20, 21, 57, 400])
def test_frames_that_are_too_many_are_thinned_evenly(tmp_path: Path, frames: int) -> None:
    kept = _EvenlySpread(10)
    on_disk = 0
    for number in range(frames):
        if kept.wants_next():
            stored = StoredPhoto(f"{number}.jpg", number, 1, 1, None, 1.0, b"")
            (tmp_path / stored.file).touch()
            kept.add(stored, tmp_path)
        on_disk = max(on_disk, len(list(tmp_path.iterdir())))
    chosen = [stored.frame or 0 for stored in kept.finish(tmp_path)]
    assert len(chosen) == min(frames, 10)
    assert {f"{number}.jpg" for number in chosen} == {file.name for file in tmp_path.iterdir()}
    assert on_disk <= 21
    if frames >= 10:
        steps = [b - a for a, b in pairwise(chosen)]
        assert max(steps) <= 2.1 * frames / 10
        assert chosen[-1] >= frames * 0.85
