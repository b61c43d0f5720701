"""The process that reads a clip: `python -m walltopo_gym.clips.reader`.

It decodes an untrusted video and computes for a minute, so it runs where it can be killed. One
request on stdin, messages as lines of JSON on stdout; it ends when its parent does.
"""

from __future__ import annotations

import math
import os
import sys
import time
from pathlib import Path
from typing import Any, Literal, TypeAlias

import msgspec

from walltopo.core import InputError, Silent
from walltopo.core.children import end_with_parent
from walltopo.reconstruct.ingest.video import video_seconds
from walltopo.scans.folder import ScanFolder
from walltopo_climb.beta.attempt_file import attempt_file
from walltopo_climb.beta.clip import RATE, read_clip
from walltopo_climb.beta.film import write_film
from walltopo_climb.beta.refusal import ClipError, ClipFault
from walltopo_climb.beta.scanned_wall import ScannedWall
from walltopo_gym.scans.artifacts import landmarks_of

Fault = ClipFault | Literal["no-route", "too-slow", "too-large", "failed"]

_INTERVAL_S = 1.0  # between two messages that only count


class ReadRequest(msgspec.Struct, frozen=True):
    """A video, the folder of a scan, the number of a route in it, and the longest clip.

    `film`: the file for the film that others may see; empty: none is wanted.
    """

    video: str
    scan: str
    route: int
    max_seconds: float
    film: str = ""


class Phase(msgspec.Struct, frozen=True, tag="phase"):
    """The present step: loading the wall, reading frames, or making the film; `total` is None if it
    is unknown."""

    name: Literal["wall", "frames", "film"]
    done: int = 0
    total: int | None = None


class Found(msgspec.Struct, frozen=True, tag="found"):
    """The attempt as the values of `attempt.json`; the route's holds, the lowest first."""

    attempt: dict[str, Any]
    holds: list[int]


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    """The clip could not be read."""

    fault: Fault


Message: TypeAlias = Phase | Found | Refused


class _Reporter(Silent):
    """Sends messages to the parent, and the progress of a clip's frames."""

    def __init__(self, out: int) -> None:
        self._out = os.fdopen(out, "wb", buffering=0)
        self._done, self._sent_at = 0, 0.0
        self._total: int | None = None

    def send(self, message: Message) -> None:
        self._out.write(msgspec.json.encode(message) + b"\n")

    def begin_frames(self, total: int | None) -> None:
        self._total = total
        self.send(Phase("frames", 0, total))

    def advance(self, count: int = 1) -> None:
        self._done += count
        if time.monotonic() - self._sent_at >= _INTERVAL_S:
            self.send(Phase("frames", self._done, self._total))
            self._sent_at = time.monotonic()


def read(request: ReadRequest, reporter: _Reporter) -> Found:
    """Return what a clip shows.

    Raises
    ------
    ClipError : it cannot be read.
    """
    reporter.send(Phase("wall"))
    seconds = _clip_seconds(request)
    folder = ScanFolder(request.scan)
    wall = ScannedWall.load(folder, landmarks_of(folder))
    route = next(one for one in wall.routes if one.id == request.route)
    reporter.begin_frames(math.ceil(seconds * RATE) if math.isfinite(seconds) else None)
    reading = read_clip(Path(request.video), wall, route.id, reporter, request.max_seconds)
    attempt = attempt_file(reading, wall, "")
    if request.film:
        reporter.send(Phase("film"))
        write_film(Path(request.video), Path(request.film), reading.frames, request.max_seconds)
    heights = {hold.id: hold.position[2] for hold in wall.holds}
    holds = sorted(route.holds, key=lambda hold: heights[hold])
    return Found(msgspec.to_builtins(attempt, str_keys=True), holds)


def _clip_seconds(request: ReadRequest) -> float:
    """Return the video's length; infinity if its header does not declare it."""
    try:
        seconds = video_seconds(Path(request.video))
    except InputError as error:
        raise ClipError("no-video", error.message, error.hint) from error
    if math.isfinite(seconds) and seconds > request.max_seconds:
        raise ClipError("too-long", f"is longer than {request.max_seconds:.0f} seconds")
    return seconds


def main() -> None:
    """Read one clip at the lowest priority."""
    reporter = _Reporter(os.dup(1))
    os.dup2(2, 1)  # what libraries print goes to the operator's log
    os.nice(19)
    request = msgspec.json.decode(sys.stdin.buffer.readline(), type=ReadRequest)
    end_with_parent()
    try:
        reporter.send(read(request, reporter))
    except ClipError as error:
        reporter.send(Refused(error.fault))


if __name__ == "__main__":
    main()
