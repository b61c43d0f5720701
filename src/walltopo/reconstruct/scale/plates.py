"""Define the geometry of scale plates: the position of each marker's corners."""

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
from walltopo.core.files import read_toml
from walltopo.images.markers import STICKER_MARGIN, STICKER_SIDE, STICKERS
from walltopo.scans.document import parse

# The ids identify the size: the three built-in kinds share one dictionary and no id.
BUILT_IN = """\
# The built-in plates of walltopo. Lengths in metres.
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
copies = 3
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

[[plate]]            # `walltopo measure print --paper letter`
name = "letter"
dictionary = "DICT_4X4_50"
ids = [32, 33, 34, 35]
size = [0.2794, 0.2159]
marker = 0.075
margin = 0.010
"""

MarkerId = Annotated[int, msgspec.Meta(ge=0, le=10_000)]
Metres = Annotated[float, msgspec.Meta(ge=0, le=100)]


class _Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A [[plate]] table of a TOML file; see `Plate`."""

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
    """A flat printed sheet with four markers, or a sticker: one marker at its centre.

    The plate's frame has its origin at the centre, x to the right along the top edge, y up the page
    and z out of the print; metres.

    Parameters
    ----------
    name : kind of plate.
    dictionary : OpenCV's name of the marker dictionary.
    ids : marker ids: top left, top right, bottom right, bottom left; or the one of a sticker.
    size : width and height.
    marker : side of a marker.
    margin : distance from the markers to the plate's edges.
    thickness : height of the print above the floor.
    floor : whether the plate lies on the floor (on a wall it gives the scale alone).
    """

    name: str
    dictionary: str
    ids: tuple[int, ...]
    size: tuple[float, float]
    marker: float
    margin: float
    thickness: float = 0.0
    floor: bool = True

    @property
    def label(self) -> str:
        """Return the plate's name in messages: kind, lowest and highest id."""
        if len(self.ids) == 1:
            return f"{self.name} {self.ids[0]}"
        return f"{self.name} {min(self.ids)}-{max(self.ids)}"

    @property
    def outline(self) -> NDArray[np.float64]:
        """Return the (4, 3) corners of the sheet: top left, top right, bottom right, bottom
        left."""
        x, y = self.size[0] / 2, self.size[1] / 2
        return np.array([(-x, y, 0.0), (x, y, 0.0), (x, -y, 0.0), (-x, -y, 0.0)])

    def corners(self, marker: int, growth: float = 0.0) -> NDArray[np.float64]:
        """Return the (4, 3) corners of a marker: top left, top right, bottom right, bottom left.

        Parameters
        ----------
        growth : share by which the marker looks larger about its centre.
        """
        square = (1 + growth) * self.marker / 2 * np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)])
        if len(self.ids) == 1:
            return np.column_stack([square, np.zeros(4)])
        place = self.ids.index(marker)
        half = self.marker / 2
        x = self.size[0] / 2 - self.margin - half
        y = self.size[1] / 2 - self.margin - half
        centre = np.array([(-x, y), (x, y), (x, -y), (-x, -y)][place])
        return np.column_stack([centre + square, np.zeros(4)])


def sticker(code: int) -> Plate:
    """Return a sticker of `walltopo measure print --stickers` as a plate on a wall."""
    side = STICKER_SIDE + 2 * STICKER_MARGIN
    return Plate(
        "sticker", STICKERS, (code,), (side, side), STICKER_SIDE, STICKER_MARGIN, floor=False
    )


def built_in_plates() -> list[Plate]:
    """Return the plates of `BUILT_IN`."""
    return _parse(tomllib.loads(BUILT_IN), "the built-in plates")


def read_plates(path: Path) -> list[Plate]:
    """Read the plates of a TOML file in the format of `BUILT_IN`.

    Raises
    ------
    InputError : invalid TOML, an unknown or missing key, an impossible shape, or a duplicate id.
    """
    return _parse(read_toml(path), str(path))


def _parse(table: dict[str, Any], source: str) -> list[Plate]:
    entries = parse(table, _Plates, source).plate
    plates = [plate for entry in entries for plate in _expand_copies(entry, source)]
    if not plates:
        raise InputError(f"{source}: holds no [[plate]] table")
    _check_unique_ids(plates, source)
    return plates


def _expand_copies(entry: _Entry, source: str) -> list[Plate]:
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


def _check_unique_ids(plates: Sequence[Plate], source: str) -> None:
    seen: dict[tuple[str, int], str] = {}
    for plate in plates:
        for marker in plate.ids:
            other = seen.setdefault((plate.dictionary, marker), plate.label)
            if other != plate.label or plate.ids.count(marker) > 1:
                raise InputError(f"{source}: marker {marker} is on both {other} and {plate.label}")
