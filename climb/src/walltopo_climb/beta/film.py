"""The film of a clip that others may see: only the climber stays visible of the people in it.

It has no sound and no metadata. Others are found five times a second; each hides the pixels of the
box around for half a second before and after. A person whom the network never sees stays visible,
so the climber looks at the film before anybody else does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import atomic_path
from walltopo.images.fill import hide_pixels
from walltopo.images.people import find_people
from walltopo.reconstruct.ingest.video import timed_frames
from walltopo.segment.detect.photo_detections import box_iou
from walltopo_climb.beta.clip import MAX_SECONDS
from walltopo_climb.beta.in_view import Floats, Frames

Image = NDArray[np.uint8]

SIDE: Final = 960  # pixels, the longer one
RATE: Final = 25.0  # frames per second at most
_SEARCHES: Final = 5.0  # per second
_AROUND_S: Final = 0.5  # before and after, for which a person's box is hidden
_MARGIN: Final = 0.15  # of the sides of a box that is hidden
_QUALITY: Final = "27"  # x264's constant rate factor
_TICKS: Final = 1000  # of the file's clock, per second


@dataclass(frozen=True, eq=False)
class _Others:
    """Boxes of people who do not climb: times (N,) s, boxes (N, 4) x0, y0, x1, y1 as shares of the
    picture's sides."""

    times: Floats
    boxes: Floats

    def hide(self, time: float, frame: Image) -> Image:
        """Return a frame without the people who are found near its time."""
        near = self.boxes[np.abs(self.times - time) <= _AROUND_S]
        if len(near) == 0:
            return frame
        height, width = frame.shape[:2]
        mask = np.zeros((height, width), np.bool_)
        for x0, y0, x1, y1 in near * [width, height, width, height]:
            across, down = _MARGIN * (x1 - x0), _MARGIN * (y1 - y0)
            rows = slice(max(int(y0 - down), 0), int(np.ceil(y1 + down)))
            mask[rows, max(int(x0 - across), 0) : int(np.ceil(x1 + across))] = True
        return hide_pixels(frame, mask)


def write_film(clip: Path, film: Path, frames: Frames, max_seconds: float = MAX_SECONDS) -> None:
    """Write the film of a clip as MP4 (H.264, without sound).

    Parameters
    ----------
    clip : a video. frames : the climber in it.

    Raises
    ------
    InputError : the clip cannot be decoded. LongVideoError : it is too long.
    """
    import av

    others = _others(clip, frames, max_seconds)
    with atomic_path(film) as temporary, av.open(str(temporary), "w", format="mp4") as container:
        stream = container.add_stream(
            "libx264", rate=round(RATE), options={"crf": _QUALITY, "preset": "veryfast"}
        )
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = Fraction(1, _TICKS)
        begun = False
        for time, picture in timed_frames(clip, RATE, max_seconds, SIDE):
            shown = _even_sides(others.hide(time, picture))
            if not begun:
                stream.height, stream.width = shown.shape[:2]
                begun = True
            frame = av.VideoFrame.from_ndarray(shown, "rgb24")
            frame.pts, frame.time_base = round(time * _TICKS), Fraction(1, _TICKS)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _even_sides(picture: Image) -> Image:
    """Return a picture with even sides, as the codec needs them."""
    height, width = picture.shape[:2]
    return np.ascontiguousarray(picture[: height - height % 2, : width - width % 2])


def _others(clip: Path, frames: Frames, max_seconds: float) -> _Others:
    times: list[float] = []
    boxes: list[Floats] = []
    for time, picture in timed_frames(clip, _SEARCHES, max_seconds, SIDE):
        height, width = picture.shape[:2]
        sides = np.array([width, height, width, height])
        people = [np.array(person.box) / sides for person in find_people(picture)]
        climber = _nearest_box(people, _body_box(frames, time))
        for number, box in enumerate(people):
            if number != climber:
                times.append(time)
                boxes.append(box)
    return _Others(np.array(times), np.array(boxes).reshape(-1, 4))


def _body_box(frames: Frames, time: float) -> Floats:
    """Return the box around limbs and hips at a time, as shares of the picture's sides."""
    frame = int(np.abs(frames.times - time).argmin())
    points = np.vstack([frames.points[frame], frames.hips[frame]])
    points = points / [frames.camera.width, frames.camera.height]
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def _nearest_box(boxes: Sequence[Floats], body: Floats) -> int | None:
    """Return the number of the box that overlaps most with the body's; None if none does."""
    if not boxes:
        return None
    shares = box_iou(np.array(boxes), body[None])[:, 0]
    best = int(shares.argmax())
    return best if shares[best] > 0 else None
