"""The clips of `walltopo film` and their truths: `N.mp4` and `N.json`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec

from walltopo.core import Camera, InputError
from walltopo.scans.attempt import Seconds
from walltopo.scans.document import Document, Label, Side

Row = tuple[float, float, float, float]


class ContactTruth(msgspec.Struct, frozen=True):
    """A limb on a hold of the gym; `begin_s` and `end_s` in the file."""

    limb: Annotated[int, msgspec.Meta(ge=0, le=3)]
    hold: Label
    begin: Seconds = msgspec.field(name="begin_s")
    end: Seconds = msgspec.field(name="end_s")


class FilmedClip(Document, frozen=True, kw_only=True):
    """The truth of a clip.

    Parameters
    ----------
    route : id in the gym, number + 1. body : a name of `BODIES`.
    length : `length_s` in the file.
    focal : pixels; the camera has no distortion, its centre is that of the picture.
    cam_from_world : (F, 3, 4) of the frames, metres.
    """

    route: Label
    body: str
    is_topped: bool
    is_handheld: bool
    has_passer: bool
    length: Seconds = msgspec.field(name="length_s")
    width: Side
    height: Side
    focal: float
    cam_from_world: tuple[tuple[Row, Row, Row], ...]
    contacts: tuple[ContactTruth, ...]

    @property
    def camera(self) -> Camera:
        """Return the camera of all frames."""
        return pinhole(self.width, self.height, self.focal)


def read_clips(folder: Path) -> list[tuple[Path, FilmedClip]]:
    """Return the clips of a folder of `walltopo film` and their truths.

    Raises
    ------
    InputError : the folder has no clips, or a truth is missing or damaged.
    """
    videos = sorted(folder.glob("*.mp4"), key=lambda path: (len(path.stem), path.stem))
    if not videos:
        raise InputError(f"{folder}: no clips here", "`walltopo film` makes some.")
    return [(video, FilmedClip.load(video.with_suffix(".json"))) for video in videos]


def pinhole(width: int, height: int, focal: float) -> Camera:
    """Return a camera without distortion whose centre is that of the picture."""
    return Camera("SIMPLE_PINHOLE", width, height, (focal, width / 2, height / 2))
