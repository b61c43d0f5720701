"""The colours of a gym: found by clustering, or read from a `palette.toml`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import atomic_path, read_toml
from walltopo.images.colour import features, linear_from_srgb8
from walltopo.scans.document import parse
from walltopo.scans.holds import Hold, Role

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Basic colour terms with the sRGB of typical hold paint (polyurethane and fibreglass, our reading
# of manufacturers' RAL charts; white as measured: the brightest pixels of a hold do not count).
# Each cluster is named after the nearest one.
REFERENCE: dict[str, tuple[int, int, int]] = {
    "black": (38, 38, 40),
    "grey": (125, 127, 130),
    "white": (208, 206, 198),
    "red": (195, 32, 38),
    "orange": (238, 118, 30),
    "yellow": (245, 200, 25),
    "lime": (150, 200, 50),
    "green": (40, 145, 65),
    "mint": (60, 190, 165),
    "sky": (100, 180, 225),
    "blue": (30, 85, 185),
    "purple": (110, 55, 160),
    "pink": (230, 80, 145),
    "brown": (110, 72, 45),
    "wood": (200, 160, 112),
}

SMALL = 0.3  # tolerance added for merging small groups, divided by the square root of their size
MEDIAN_ROUNDS = 4


@dataclass(frozen=True)
class Entry:
    """One colour of a gym's palette.

    Parameters
    ----------
    name : the gym's name of the colour.
    rgb : 0..255 sRGB, as `classify` measures holds of this colour.
    role : role of holds of this colour: "hold" (default), "volume" or "downclimb".
    """

    name: str
    rgb: tuple[int, int, int]
    role: Role = "hold"


Level = Annotated[int, msgspec.Meta(ge=0, le=255)]


class _Row(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A [[colour]] table; see `Entry`."""

    rgb: tuple[Level, Level, Level]
    name: str = ""
    role: Role = "hold"


class _Palette(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    colour: tuple[_Row, ...] = ()


def _linear(colours: Sequence[tuple[int, int, int]]) -> Floats:
    return linear_from_srgb8(np.array(colours, dtype=np.uint8).reshape(-1, 3))


def _reference(lightness_weight: float) -> Floats:
    return features(_linear(list(REFERENCE.values())), lightness_weight)


def name_of(rgb: tuple[int, int, int], lightness_weight: float) -> str:
    """Return the nearest basic colour term."""
    own = features(_linear([rgb]), lightness_weight)
    distance = np.linalg.norm(_reference(lightness_weight) - own, axis=1)
    return list(REFERENCE)[int(distance.argmin())]


def cluster_colours(points: Floats, spread: float, lightness_weight: float) -> dict[str, Ints]:
    """Group colours by k-medians that start from the basic colour terms.

    Each round assigns the colours to the nearest centre, moves the centres to the medians of
    their colours, and drops empty centres. It then dissolves the smaller of the two nearest
    centres if they lie within `spread`. For small groups, whose medians are less reliable, the
    limit is larger by a factor 1 + `SMALL` / sqrt(size). The method was chosen over average
    linkage on generated gyms: docs/colours.md.

    Parameters
    ----------
    points : (n, 3) colour features (`features` with `lightness_weight`).
    spread : centres nearer than this are one colour.

    Returns
    -------
    Colour term of each group's starting centre, to the rows of `points`; largest group first.
    """
    names, centres = list(REFERENCE), _reference(lightness_weight)
    alive = np.ones(len(centres), dtype=np.bool_)
    while True:
        for _ in range(MEDIAN_ROUNDS):
            nearest = _nearest(points, centres, alive)
            sizes = np.bincount(nearest, minlength=len(centres))
            alive = sizes > 0
            for number in np.flatnonzero(alive):
                centres[number] = np.median(points[nearest == number], axis=0)
        rows = np.flatnonzero(alive)
        gap = np.linalg.norm(centres[rows][:, None] - centres[rows][None], axis=2)
        smaller = np.minimum(sizes[rows][:, None], sizes[rows][None])
        closeness = gap / (spread * (1 + SMALL / np.sqrt(smaller)))
        np.fill_diagonal(closeness, np.inf)
        if len(rows) < 2 or closeness.min() >= 1:
            break
        one, two = rows[list(np.unravel_index(int(closeness.argmin()), closeness.shape))]
        alive[two if sizes[one] >= sizes[two] else one] = False
    by_size = rows[np.argsort(-sizes[rows], kind="stable")]
    return {names[number]: np.flatnonzero(nearest == number) for number in by_size}


def _nearest(points: Floats, centres: Floats, alive: NDArray[np.bool_]) -> Ints:
    distance = np.linalg.norm(points[:, None] - centres[None], axis=2)
    distance[:, ~alive] = np.inf
    return distance.argmin(axis=1)


def read_palette(path: Path, lightness_weight: float) -> list[Entry]:
    """Read a `palette.toml`; entries without a name get the nearest basic colour term.

    Raises
    ------
    InputError : the file is missing or not TOML, or an entry is invalid (the message names it).
    """
    hint = "`walltopo palette learn SCAN` writes a file to start from."
    rows = parse(read_toml(path, hint), _Palette, str(path)).colour
    if not rows:
        raise InputError(f"{path}: has no [[colour]] table", "See docs/colours.md.")
    return [
        Entry(row.name or name_of(row.rgb, lightness_weight), row.rgb, row.role) for row in rows
    ]


def palette_of_holds(holds: Sequence[Hold]) -> tuple[list[Entry], list[int]]:
    """Return the colours of holds, most frequent first, and the number of holds of each.

    The reference colour is the median of the holds' own colours. The role is the holds' role if
    they agree; volumes are ignored, because they may share a colour with holds.
    """
    groups: dict[str, list[Hold]] = {}
    for hold in holds:
        if hold.colour != "unknown":
            groups.setdefault(hold.colour, []).append(hold)
    entries: list[Entry] = []
    counts: list[int] = []
    for name, members in sorted(groups.items(), key=lambda item: (-len(item[1]), item[0])):
        red, green, blue = np.median([hold.colour_rgb for hold in members], axis=0)
        roles = {hold.role for hold in members if hold.kind != "volume"}
        role = roles.pop() if len(roles) == 1 else "hold"
        entries.append(Entry(name, (round(red), round(green), round(blue)), role))
        counts.append(len(members))
    return entries, counts


def write_palette(path: Path, entries: Sequence[Entry], counts: Sequence[int]) -> None:
    """Write a `palette.toml` that a setter can edit; atomic.

    Parameters
    ----------
    counts : number of holds of each colour, written as a comment.
    """
    lines = [
        "# Colours of this gym. Rename them as you like; two entries may share a name (for",
        '# example new and faded paint). role = "downclimb": holds of no route;',
        '# role = "volume": belong to every route; without a role: holds of a route.',
        "",
    ]
    for entry, count in zip(entries, counts, strict=True):
        name = entry.name.replace("\\", "\\\\").replace('"', '\\"')
        lines += [
            f"[[colour]]  # {count} holds",
            f'name = "{name}"',
            f"rgb = [{entry.rgb[0]}, {entry.rgb[1]}, {entry.rgb[2]}]",
            *([f'role = "{entry.role}"'] if entry.role != "hold" else []),
            "",
        ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines), encoding="utf-8")
