"""The legend of a painted mesh: the meaning of its colours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.files import read_json, write_json
from walltopo.scans.document import Level, parse

Rgb = tuple[int, int, int]


@dataclass(frozen=True)
class Legend:
    """Colours of the wall and of known objects; other colours are new objects.

    Parameters
    ----------
    wall : colours of the wall, which is no object.
    objects : colour to class name.
    default : class of objects whose colour is not listed.
    classes : class names in the order of their ids (1, 2, ...).
    tolerance : a colour within this many of 255 levels (largest channel difference) of a listed
        one counts as that one, because programs round colours.
    """

    wall: tuple[Rgb, ...] = ((190, 190, 190), (255, 255, 255))
    objects: Mapping[Rgb, str] = field(default_factory=dict[Rgb, str])
    default: str = "hold"
    classes: tuple[str, ...] = ("hold", "volume")
    tolerance: int = 3

    def __post_init__(self) -> None:
        if not self.wall:
            raise InputError("legend: `wall` needs a colour")
        stray = sorted({self.default, *self.objects.values()} - set(self.classes))
        if stray:
            raise InputError(f"legend: unknown classes {stray}; known: {', '.join(self.classes)}")


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of a legend file; see `read_legend`."""

    wall: tuple[str, ...] | None = None
    objects: dict[str, str] = {}
    default: str | None = None
    classes: Annotated[tuple[str, ...], msgspec.Meta(min_length=1)] | None = None
    tolerance: Level = 3


def _rgb(text: str, where: Path) -> Rgb:
    match = re.fullmatch(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})", text.strip())
    if match is None:
        raise InputError(f"{where}: {text!r} is not a colour; expected #rrggbb")
    r, g, b = (int(part, 16) for part in match.groups())
    return r, g, b


def read_legend(path: Path) -> Legend:
    """Read a legend JSON.

    `{"wall": ["#bebebe"], "objects": {"#ff0000": "volume"}, "default": "hold",
    "classes": ["hold", "volume"], "tolerance": 3}`; every key is optional.
    """
    data = parse(read_json(path), _File, str(path))
    plain = Legend()
    classes = plain.classes if data.classes is None else data.classes
    default = classes[0] if data.default is None else data.default
    wall = plain.wall if data.wall is None else tuple(_rgb(c, path) for c in data.wall)
    objects = {_rgb(colour, path): name for colour, name in data.objects.items()}
    with prefix_errors(path):
        return Legend(wall, objects, default, classes, data.tolerance)


def write_legend(path: Path, legend: Legend) -> None:
    """Write a legend in the format of `read_legend`."""
    write_json(
        path,
        {
            "wall": ["#{:02x}{:02x}{:02x}".format(*c) for c in legend.wall],
            "objects": {
                "#{:02x}{:02x}{:02x}".format(*c): name for c, name in legend.objects.items()
            },
            "default": legend.default,
            "classes": list(legend.classes),
            "tolerance": legend.tolerance,
        },
    )


def object_colours(count: int) -> NDArray[np.uint8]:
    """Return (count, 3) colours: vivid, never grey, and at least 8 levels apart in some channel.

    The colours come from a 28-level grid, most saturated first. Consecutive colours differ strongly
    in hue, so that neighbouring objects look different and rounding cannot confuse two colours.
    """
    levels = np.arange(0, 256, 17 if count > 400 else 28)
    grid = np.stack(np.meshgrid(levels, levels, levels), axis=-1).reshape(-1, 3)
    spread = grid.max(axis=1) - grid.min(axis=1)
    vivid = grid[spread >= 80]
    if count > len(vivid):
        raise InputError(f"{count} objects; a painted mesh can hold {len(vivid)} colours")
    order = np.argsort(-(vivid.max(axis=1) - vivid.min(axis=1)), kind="stable")[:count]
    # A step coprime to the length visits all colours and keeps consecutive ones far apart.
    step = max(1, round(count * 0.382))
    while np.gcd(step, count) > 1:
        step += 1
    return vivid[order[(np.arange(count) * step) % count]].astype(np.uint8)
