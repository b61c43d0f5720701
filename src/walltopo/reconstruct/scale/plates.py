"""The geometry of printed measures: where each marker's corners lie on its plate."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.toml import read_toml
from walltopo.scans.document import parse

# Ids tell the size: the three built-in kinds share one dictionary and no id.
BUILT_IN = """\
# The plates that walltopo knows without being told. Lengths in metres.
# ids: top left, top right, bottom right, bottom left, seen from above with the print upright.

[[plate]]            # a stiff board
name = "board"
dictionary = "DICT_4X4_50"
ids = [0, 1, 2, 3]
copies = 5           # the next plates of the same shape carry ids 4-7, 8-11, ...
size = [0.42, 0.42]  # width, height
marker = 0.15        # side of a marker (its black square)
margin = 0.02        # from the markers to the edges of the plate
thickness = 0.004    # height of the print above the floor
floor = true         # lies on the floor

[[plate]]            # `walltopo measure print --paper a4`
name = "a4"
dictionary = "DICT_4X4_50"
ids = [20, 21, 22, 23]
copies = 4
size = [0.297, 0.210]
marker = 0.080
margin = 0.010

[[plate]]            # `walltopo measure print --paper a3`
name = "a3"
dictionary = "DICT_4X4_50"
ids = [36, 37, 38, 39]
copies = 3
size = [0.420, 0.297]
marker = 0.115
margin = 0.012
"""

MarkerId = Annotated[int, msgspec.Meta(ge=0, le=10_000)]
Metres = Annotated[float, msgspec.Meta(ge=0, le=100)]


class _Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A [[plate]] table; see `Plate`."""

    ids: tuple[MarkerId, MarkerId, MarkerId, MarkerId]
    size: tuple[Metres, Metres]
    marker: Annotated[float, msgspec.Meta(gt=0, le=100)]
    margin: Metres
    name: str = "plate"
    dictionary: str = "DICT_4X4_50"
    copies: Annotated[int, msgspec.Meta(ge=0, le=1000)] = 1
    thickness: Metres = 0.0
    floor: bool = True


class _Plates(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    plate: tuple[_Entry, ...]


@dataclass(frozen=True)
class Plate:
    """A flat print of four markers.

    Its frame: origin at the centre, x to the right along the top edge, y up the page, z out of
    the print; metres.

    Parameters
    ----------
    name : kind of plate.
    dictionary : OpenCV's name of the marker dictionary.
    ids : marker ids, top left, top right, bottom right, bottom left.
    size : width and height.
    marker : side of a marker.
    margin : from the markers to the plate's edges.
    thickness : height of the print above the floor.
    floor : whether it lies on the floor (else, say, on the wall: it gives the scale alone).
    """

    name: str
    dictionary: str
    ids: tuple[int, int, int, int]
    size: tuple[float, float]
    marker: float
    margin: float
    thickness: float = 0.0
    floor: bool = True

    @property
    def label(self) -> str:
        """How messages call it: its lowest and highest id."""
        return f"{self.name} {min(self.ids)}-{max(self.ids)}"

    @property
    def outline(self) -> NDArray[np.float64]:
        """(4, 3) corners of the sheet: top left, top right, bottom right, bottom left."""
        x, y = self.size[0] / 2, self.size[1] / 2
        return np.array([(-x, y, 0.0), (x, y, 0.0), (x, -y, 0.0), (-x, -y, 0.0)])

    def corners(self, marker: int) -> NDArray[np.float64]:
        """(4, 3) corners of one marker: top left, top right, bottom right, bottom left."""
        place = self.ids.index(marker)
        half = self.marker / 2
        x = self.size[0] / 2 - self.margin - half
        y = self.size[1] / 2 - self.margin - half
        centre = np.array([(-x, y), (x, y), (x, -y), (-x, -y)][place])
        square = half * np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)])
        return np.column_stack([centre + square, np.zeros(4)])


def marker_cells(dictionary: str, marker: int) -> NDArray[np.bool_]:
    """(n, n) bool, which cells of a marker (border included) are white, top row first."""
    import cv2

    number = getattr(cv2.aruco, dictionary, None)
    if not dictionary.startswith("DICT_") or number is None:
        raise InputError(f"{dictionary!r} is not an ArUco dictionary of OpenCV")
    table = cv2.aruco.getPredefinedDictionary(number)
    if not 0 <= marker < len(table.bytesList):
        raise InputError(f"{dictionary} has markers 0 to {len(table.bytesList) - 1}, not {marker}")
    cells = table.markerSize + 2
    image = cv2.aruco.generateImageMarker(table, marker, cells)
    return np.asarray(image) > 127


def built_in_plates() -> list[Plate]:
    """The plates of `BUILT_IN`."""
    return _parse(tomllib.loads(BUILT_IN), "the built-in plates")


def read_plates(path: Path) -> list[Plate]:
    """Plates of a TOML file (see `BUILT_IN` for its form).

    Raises
    ------
    InputError : not TOML, an unknown or missing key, an impossible shape, an id used twice.
    """
    return _parse(read_toml(path), str(path))


def _parse(table: dict[str, Any], source: str) -> list[Plate]:
    entries = parse(table, _Plates, source).plate
    plates = [plate for entry in entries for plate in _copies(entry, source)]
    if not plates:
        raise InputError(f"{source}: holds no [[plate]] table")
    _refuse_shared_ids(plates, source)
    return plates


def _copies(entry: _Entry, source: str) -> list[Plate]:
    ids, marker, margin = entry.ids, entry.marker, entry.margin
    width, height = entry.size
    if min(width, height) < 2 * (marker + margin):
        raise InputError(
            f"{source}: [[plate]]: two markers of {marker} m with margins of {margin} m do not "
            f"fit on {width} x {height} m (lengths are metres)"
        )
    return [
        Plate(
            entry.name,
            entry.dictionary,
            (ids[0] + 4 * k, ids[1] + 4 * k, ids[2] + 4 * k, ids[3] + 4 * k),
            (width, height),
            marker,
            margin,
            entry.thickness,
            entry.floor,
        )
        for k in range(max(1, entry.copies))
    ]


def _refuse_shared_ids(plates: Sequence[Plate], source: str) -> None:
    seen: dict[tuple[str, int], str] = {}
    for plate in plates:
        for marker in plate.ids:
            other = seen.setdefault((plate.dictionary, marker), plate.label)
            if other != plate.label or plate.ids.count(marker) > 1:
                raise InputError(f"{source}: marker {marker} is on both {other} and {plate.label}")
