"""The process that reads a clip: its answer, its limits, and its end."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from gym.tests.clips.film import tiny_clip

from walltopo.core import StageError
from walltopo_gym.clips import child
from walltopo_gym.clips.child import Limits, WithdrawnError, read_in_child
from walltopo_gym.clips.reader import Found, Phase, ReadRequest, Refused
from walltopo_gym.scans.running import WorkerStopsError

Once = Callable[[str, Callable[[Path], object]], Path]
REQUEST = ReadRequest("video", "scan", 1, 61.0)
WAIT = 'import time; print(\'{"type":"phase","name":"wall"}\', flush=True); time.sleep(60)'


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Run a script in place of the reader."""

    def run(text: str) -> None:
        monkeypatch.setattr(child, "python_module", lambda name: [sys.executable, "-c", text])

    return run


def limits(seconds: float = 60.0, memory_mb: float = 0.0) -> Limits:
    return Limits(seconds, memory_mb, threading.Event())


def test_a_reading_ends_at_its_limits(script: Callable[[str], None]) -> None:
    script(WAIT)
    begun = time.monotonic()
    assert read_in_child(REQUEST, limits(0.1), lambda _: True) == Refused("too-slow")
    assert read_in_child(REQUEST, limits(memory_mb=1.0), lambda _: True) == Refused("too-large")
    assert time.monotonic() - begun < 30


def test_a_reading_ends_with_its_clip_and_with_its_worker(script: Callable[[str], None]) -> None:
    script(WAIT)
    with pytest.raises(WithdrawnError):
        read_in_child(REQUEST, limits(), lambda _: False)
    stopping = threading.Event()

    def stop(_: Phase) -> bool:
        stopping.set()
        return True

    with pytest.raises(WorkerStopsError):
        read_in_child(REQUEST, Limits(60, 0, stopping), stop)


def test_a_process_that_dies_is_a_failure(script: Callable[[str], None]) -> None:
    script("raise SystemExit(7)")
    with pytest.raises(StageError, match="exit code 7"):
        read_in_child(REQUEST, limits(), lambda _: True)


def test_a_file_that_is_not_a_video_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"not a video")
    request = ReadRequest(str(tmp_path / "a"), str(tmp_path), 1, 61.0)
    assert read_in_child(request, limits(), lambda _: True) == Refused("no-video")


@pytest.mark.slow
def test_a_clip_is_read(tiny_scan: Path, once: Once) -> None:
    phases: list[Phase] = []

    def report(phase: Phase) -> bool:
        phases.append(phase)
        return True

    video = once("tiny-clip", tiny_clip) / "clip.mp4"
    request = ReadRequest(str(video), str(tiny_scan), 2, 61.0)
    found = read_in_child(request, limits(600), report)
    assert isinstance(found, Found)
    assert found.attempt["route"] == 2
    assert found.attempt["top_s"] == pytest.approx(6.9, abs=1.0)
    assert len(found.attempt["moves"]) > 4
    assert len(found.holds) == 5
    assert [phase.name for phase in phases][:2] == ["wall", "frames"]
    assert phases[-1].total == pytest.approx(92, abs=2)
    assert 0 < phases[-1].done <= 92
    too_long = ReadRequest(str(video), str(tiny_scan), 2, 5.0)
    assert read_in_child(too_long, limits(600), report) == Refused("too-long")
