"""Pictures of a wall from the front: drawn once when a scan is done, then only cropped and faded.

A second picture of the same size has the hold of each pixel. A route's picture is composed of the
two in some milliseconds, without the mesh.
"""

from __future__ import annotations

from collections.abc import Collection
from io import BytesIO
from typing import TYPE_CHECKING, Final
from uuid import UUID

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.folder import ScanFolder
from walltopo_gym.errors import NotFoundError
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from PIL import Image


# As messengers want it: https://developers.facebook.com/docs/sharing/webmasters/images
WIDTH: Final = 1200
HEIGHT: Final = 630
_DRAWN: Final = 1600  # pixels across the wall
_ROOM: Final = 1.25  # of a route's own size
_RIM: Final = 4  # pixels of white around a lit hold
_UP: Final = np.array([0.0, 0.0, 1.0])


def store_front(store: FileStore, scan: UUID, folder: ScanFolder) -> None:
    """Draw a finished scan from the front and store the pictures."""
    from PIL import Image

    from walltopo.publish.atlas.visible_faces import front_direction
    from walltopo.publish.page_tiers import read_shown_wall
    from walltopo.publish.report.maps import paper_view

    wall = read_shown_wall(folder)
    canvas = paper_view(
        wall.mesh.vertices, wall.mesh.faces, -front_direction(wall.mesh), _UP, _DRAWN
    )
    colours = np.full((len(wall.mesh.faces), 3), 160, dtype=np.uint8)
    pixels = wall.read_texture()
    if wall.uv is not None and pixels is not None:
        size = np.array(pixels.shape[1::-1])
        at = np.clip((wall.uv.mean(axis=1) * size).astype(int), 0, size - 1)
        colours = pixels[at[:, 1], at[:, 0]]
    holds = np.append(wall.face_instance, 0)[canvas.face]
    front = Image.fromarray(canvas.picture(colours))
    _store_picture(store, f"{_prefix(scan)}/front.png", front)
    _store_picture(store, f"{_prefix(scan)}/holds.png", Image.fromarray(holds.astype(np.uint16)))


def wall_picture(store: FileStore, scan: UUID) -> bytes:
    """Return the part of the wall with holds as a JPEG of WIDTH × HEIGHT.

    Raises
    ------
    NotFoundError : the scan was never drawn.
    """
    front = _read_picture(store, scan, "front")
    held = np.asarray(_read_picture(store, scan, "holds"), dtype=np.int32) > 0
    return _jpeg(_frame_crop(front, _highlight_box(held) if held.any() else (0, 0, *front.size)))


def route_picture(store: FileStore, scan: UUID, holds: Collection[int]) -> bytes:
    """Return a picture of a route in colour, with a white rim around its holds and the rest faded.

    Raises
    ------
    NotFoundError : the scan was never drawn.
    """
    import cv2
    from PIL import Image

    front = np.asarray(_read_picture(store, scan, "front").convert("RGB"), dtype=np.uint8)
    shown = np.asarray(_read_picture(store, scan, "holds"), dtype=np.int32)
    lit = np.isin(shown, list(holds))
    if not lit.any():
        return wall_picture(store, scan)
    rim = cv2.dilate(lit.astype(np.uint8), np.ones((2 * _RIM + 1,) * 2, np.uint8)) > 0
    grey = front.mean(axis=2, keepdims=True) * 0.45 + 120.0
    drawn = np.where(lit[..., None], front, np.where(rim[..., None], 255, grey)).astype(np.uint8)
    return _jpeg(_frame_crop(Image.fromarray(drawn), _highlight_box(lit)))


def _prefix(scan: UUID) -> str:
    return f"pictures/{scan}"


def _store_picture(store: FileStore, key: str, image: Image.Image) -> None:
    stream = BytesIO()
    image.save(stream, "PNG")
    store.put(key, stream.getvalue())


def _read_picture(store: FileStore, scan: UUID, name: str) -> Image.Image:
    from PIL import Image

    try:
        content = store.read(f"{_prefix(scan)}/{name}.png")
    except NotFoundError as error:
        raise NotFoundError("picture-none") from error
    return Image.open(BytesIO(content))


def _highlight_box(lit: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of the highlighted pixels, with a margin."""
    rows, columns = (np.flatnonzero(lit.any(axis=axis)) for axis in (1, 0))
    middle = np.array([columns[0] + columns[-1], rows[0] + rows[-1]]) / 2.0
    half = np.array([np.ptp(columns), np.ptp(rows)]) / 2.0 * _ROOM + 20.0
    left, top = (middle - half).round().astype(int).tolist()
    right, bottom = (middle + half).round().astype(int).tolist()
    return left, top, right, bottom


def _frame_crop(image: Image.Image, box: tuple[int, int, int, int]) -> Image.Image:
    """Return a crop, widened to WIDTH × HEIGHT; it is white outside of the picture."""
    from PIL import Image

    left, top, right, bottom = box
    width, height = right - left, bottom - top
    wide, high = max(width, height * WIDTH // HEIGHT), max(height, width * HEIGHT // WIDTH)
    left, top = left - (wide - width) // 2, top - (high - height) // 2
    paper = Image.new("RGB", (wide, high), (245, 246, 248))
    paper.paste(image.convert("RGB"), (-left, -top))
    return paper.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)


def _jpeg(image: Image.Image) -> bytes:
    stream = BytesIO()
    image.save(stream, "JPEG", quality=82, optimize=True)
    return stream.getvalue()
