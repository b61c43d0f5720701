"""Photos and films that are well-formed and mean something else."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.bad_pictures import photos_in, picture, scan_of

_GPANO = b'<rdf:Description GPano:ProjectionType="equirectangular"/>'


def _with(*add: Callable[[Path], None]) -> Callable[[Path], list[str]]:
    """Return a maker of three photos and more files, and of the arguments that ingest them."""

    def make(root: Path) -> list[str]:
        folder = photos_in(root / "in")
        for one in add:
            one(folder)
        return scan_of(folder)

    return make


def _sphere(folder: Path) -> None:
    picture(7, (1280, 640)).save(folder / "sphere.jpg", xmp=_GPANO)


def _live_photo(folder: Path) -> None:
    """Write a second of film beside a photo of its name."""
    import av

    with av.open(str(folder / "p0.MOV"), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for number in range(30):
            pixels = np.roll(np.asarray(picture(0)), 8 * number, axis=1)
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), "rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _archive(folder: Path) -> None:
    with zipfile.ZipFile(folder / "wall.zip", "w") as archive:
        archive.write(folder / "p0.jpg", "p0.jpg")


def _other_names(folder: Path) -> None:
    picture(8).save(folder / "p8.jfif", "JPEG")
    picture(9).save(folder / "p9.bmp", "BMP")


def _previews(folder: Path) -> None:
    """Write a small picture of each photo under a name that comes before the photo's."""
    for number in range(3):
        picture(number, (1280, 960)).save(folder / f"p{number}.jpg", quality=95)
        small = picture(number, (1280, 960)).resize((640, 480))
        small.save(folder / f"p{number}.DNG", "TIFF")


def _raw(folder: Path) -> None:
    picture(8).save(folder / "raw.DNG", "TIFF", tiffinfo={254: 1})


# Name of the input, its maker, and words of the output.
PHOTO_CASES: tuple[tuple[str, Callable[[Path], list[str]], str], ...] = (
    ("a 360-degree photo among photos", _with(_sphere), "skipped sphere.jpg: a 360-degree photo"),
    ("the film of a Live Photo", _with(_live_photo), "the moving part of a Live Photo"),
    ("an archive among photos", _with(_archive), "skipped wall.zip: an archive; unpack it"),
    ("small pictures named before large ones", _with(_previews), "shows the same as p0.jpg"),
    ("a raw photo with a small preview", _with(_raw), "only the preview of 640x480 px"),
    ("pictures named .jfif and .bmp", _with(_other_names), "photos 5, skipped 0"),
)
