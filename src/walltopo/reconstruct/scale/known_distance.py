"""Scale from one known distance between two photos or two points marked in the photos."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, View
from walltopo.core.mask import MOST_SIDE
from walltopo.core.toml import read_toml
from walltopo.reconstruct.scale.rays import triangulate
from walltopo.scans.document import parse

Floats = NDArray[np.float64]
Pixel = Annotated[float, msgspec.Meta(ge=0, le=MOST_SIDE)]


def parse_distance(text: str, known: Sequence[str]) -> tuple[str, str, float]:
    """The two names and the metres of `A-B=1.23`; names may contain hyphens.

    Raises
    ------
    InputError : not of that form, not a positive number, or a name that is not known.
    """
    pair, equals, number = text.rpartition("=")
    try:
        metres = float(number)
    except ValueError:
        metres = float("nan")
    if not equals or not np.isfinite(metres) or metres <= 0:
        raise InputError(
            f"scale.distance: expected A-B=METRES such as left-right=1.23, got {text!r}"
        )
    parts = pair.split("-")
    splits = [("-".join(parts[:k]), "-".join(parts[k:])) for k in range(1, len(parts))]
    for first, second in splits:
        if first in known and second in known and first != second:
            return first, second, metres
    listed = ", ".join(sorted(known)[:12])
    raise InputError(
        f"scale.distance: {pair!r} does not name two different registered photos or points",
        f"Known names: {listed}{', ...' if len(known) > 12 else ''}.",
    )


def named_points(path: Path, views: Sequence[View]) -> dict[str, Floats]:
    """Triangulate the points of a TOML file.

    The file has one table per point, which gives its pixel (x, y from the top left corner) in
    each of two or more photos::

        [left]
        "IMG_0001.jpg" = [512.0, 300.5]
        "IMG_0004.jpg" = [498.2, 310.0]

    Returns
    -------
    Name to (3,) point in the frame of the views.

    Raises
    ------
    InputError : not readable, a photo that is not registered, or pixels that do not meet.
    """
    table = parse(read_toml(path), dict[str, dict[str, tuple[Pixel, Pixel]]], str(path))
    by_name = {view.name: view for view in views}
    points: dict[str, Floats] = {}
    for name, seen in table.items():
        if len(seen) < 2:
            raise InputError(f"{path}: point {name!r}: give its pixel in two or more photos")
        unknown = [photo for photo in seen if photo not in by_name]
        if unknown:
            raise InputError(f"{path}: point {name!r}: {unknown[0]} is not a registered photo")
        pixels = np.array(list(seen.values()))
        sizes = [(by_name[k].camera.width, by_name[k].camera.height) for k in seen]
        if ((pixels < 0) | (pixels > np.array(sizes))).any():
            raise InputError(f"{path}: point {name!r}: a pixel lies outside its photo")
        found = triangulate([by_name[photo] for photo in seen], pixels, tolerance_px=12.0)
        if found is None or not found.inliers.all():
            raise InputError(
                f"{path}: point {name!r}: its pixels do not meet in one point",
                "Check that every photo marks the same spot, and that they look at it from "
                "different places.",
            )
        points[name] = found.point
    return points


def scale_from_distance(text: str, views: Sequence[View], points: dict[str, Floats]) -> float:
    """Metres per model unit from `A-B=1.23`.

    Photos go by their file name with or without its ending, and stand for the camera's centre.

    Raises
    ------
    InputError : see `parse_distance`; or the two are at one spot.
    """
    places = {view.name.rsplit(".", 1)[0]: view.centre for view in views}
    places |= {view.name: view.centre for view in views}
    places |= points
    first, second, metres = parse_distance(text, list(places))
    apart = float(np.linalg.norm(places[first] - places[second]))
    size = float(np.ptp([view.centre for view in views], axis=0).max())
    if apart <= 1e-6 * size:
        raise InputError(f"scale.distance: {first} and {second} are at the same spot")
    return metres / apart
