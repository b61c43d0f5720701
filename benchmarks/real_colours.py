"""Colour names on photos of real walls, against names given by eye.

    python -m benchmarks.real_colours photos [DATA]   19 photos of several gyms
    python -m benchmarks.real_colours scan SCAN       the spray wall, which chose nothing

DATA is the folder of the test data (default ../shared/data), SCAN a scan of its six photos of the
spray wall. `hold_colours.json` has the names: a pixel of each hold, all names that fit it, and the
second colour of a two-coloured one. Both print how many holds get a fitting name, and how many are
called two-coloured.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from walltopo.describe.classify.achromatic import found_colours
from walltopo.describe.classify.colour import HoldPaint, paint_over_views
from walltopo.describe.classify.two_colours import large_views, split_paints
from walltopo.describe.settings import ClassifySettings
from walltopo.geometry.zbuffer import render_ids
from walltopo.images.files import read_rgb
from walltopo.publish.wall_data import read_wall
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.segment.detect.detector import open_detector
from walltopo.segment.settings import DetectSettings
from walltopo_lab.train.photo_holds import hold_at, photo_views

LABELS = Path(__file__).with_name("hold_colours.json")
APART = 100.0  # metres between the holds of a photo, so that no neighbour decides
SETTINGS = ClassifySettings()


class LabelledPhoto(msgspec.Struct, frozen=True):
    """x, y and names of each hold: "red|pink", "yellow+black" for a hold of two colours."""

    file: str
    holds: tuple[tuple[int, int, str], ...]


class _Labels(msgspec.Struct, frozen=True):
    photos: tuple[LabelledPhoto, ...]
    spraywall: tuple[LabelledPhoto, ...]


def read_labels() -> _Labels:
    """Return the names given by eye."""
    return msgspec.json.decode(LABELS.read_bytes(), type=_Labels)


def fitting(text: str) -> tuple[list[str], bool]:
    """Return the names that fit a hold, and whether it has two colours."""
    names, plus, _ = text.partition("+")
    return names.split("|"), bool(plus)


@dataclass(frozen=True, eq=False)
class Photo:
    """The paints of a photo's holds by number, and the labels of some of them.

    Parameters
    ----------
    names : hold to fitting names; second : holds with two colours.
    two : labelled holds that the network calls two-coloured; large : those that it looks at.
    """

    file: str
    paints: dict[int, HoldPaint]
    names: dict[int, list[str]]
    second: set[int]
    two: set[int]
    large: set[int]


def read_photos(data: Path) -> list[Photo]:
    """Return the labelled photos; holds that the detector misses are left out."""
    detector = open_detector(DetectSettings())
    photos = []
    for labelled in read_labels().photos:
        seen = photo_views(read_rgb(data / labelled.file), detector)
        found = {hold_at(seen.numbers, row[:2]): row for row in labelled.holds}
        found = {number: row for number, row in found.items() if number in seen.views}
        paints, two = split_paints(
            paint_over_views(seen.views, seen.light), seen.views, seen.light, set()
        )
        large = {number for number in found if large_views(seen.views[number])}
        names = {number: fitting(text)[0] for number, (_, _, text) in found.items()}
        second = {number for number, (_, _, text) in found.items() if fitting(text)[1]}
        photos.append(Photo(labelled.file, paints, names, second, set(two) & set(found), large))
    return photos


def colour_names(photo: Photo) -> dict[int, str]:
    """Return the name of each hold without its number ("red 2"), as a scan would name it."""
    places = {number: np.array([APART * number, 0.0, 0.0]) for number in photo.paints}
    _, colours = found_colours(
        photo.paints,
        places,
        set(),
        upright=True,
        spread=SETTINGS.colour_spread,
        lightness_weight=SETTINGS.lightness_weight,
    )
    return {number: colour.name.partition(" ")[0] for number, colour in colours.items()}


def right_names(photo: Photo) -> int:
    """Return the number of labelled holds whose name fits."""
    found = colour_names(photo)
    return sum(found[number] in names for number, names in photo.names.items())


def report_photos(data: Path) -> None:
    """Print the figures of the labelled photos."""
    photos = read_photos(data)
    total = sum(len(photo.names) for photo in photos)
    print(f"{sum(map(right_names, photos))} of {total} names fit")
    one = [(photo, n) for photo in photos for n in photo.large - photo.second]
    two = [(photo, n) for photo in photos for n in photo.large & photo.second]
    print(
        f"called two-coloured: {sum(n in photo.two for photo, n in one)} of {len(one)} holds of "
        f"one colour, {sum(n in photo.two for photo, n in two)} of {len(two)} of two"
    )


def report_scan(scan: ScanFolder) -> None:
    """Print the figures of a scan of the spray wall."""
    wall = read_wall(scan)
    rows = {hold.id: hold for hold in wall.holds}
    views = {view.name: view for view in read_views(scan.sparse)}
    right = total = false_two = one = found_two = two = 0
    wrong: Counter[str] = Counter()
    for labelled in read_labels().spraywall:
        view = views[Path(labelled.file).name]
        face, _ = render_ids(wall.mesh.vertices, wall.mesh.faces, view.camera, view.cam_from_world)
        numbers = np.where(face >= 0, wall.face_instance[face], 0).astype(np.int32)
        for row in labelled.holds:
            hold = rows.get(hold_at(numbers, row[:2]))
            if hold is None:
                continue
            total += 1
            name, (names, has_two) = hold.colour.partition(" ")[0], fitting(row[2])
            right += name in names
            if name not in names:
                wrong[f"{row[2]} called {name}"] += 1
            if has_two:
                two, found_two = two + 1, found_two + bool(hold.second_colour)
            else:
                one, false_two = one + 1, false_two + bool(hold.second_colour)
    used = {hold.colour for hold in wall.holds}
    print(f"{right} of {total} names fit; {len(used)} names in all")
    print(f"called two-coloured: {false_two} of {one} holds of one colour, {found_two} of {two}")
    for text, count in wrong.most_common():
        print(f"  {text}: {count}")


def main() -> None:
    if sys.argv[1:2] == ["scan"] and len(sys.argv) == 3:
        report_scan(ScanFolder(Path(sys.argv[2])))
    elif sys.argv[1:2] == ["photos"]:
        report_photos(Path(sys.argv[2] if len(sys.argv) > 2 else "../shared/data"))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
