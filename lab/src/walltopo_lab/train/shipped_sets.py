"""The sets that train the shipped detector: how their labels are read, which photos validate.

Validation is by gym where a set tells its gyms apart: file-name series of one gym are held out as
a whole. `docs/detect.md` says which of these photos an earlier training has seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Literal

from walltopo.core import InputError, Progress
from walltopo_lab.train.batches import source_of, split_sources
from walltopo_lab.train.cache import DONT_KNOW, cache_boxes, cache_coco, cache_yolo
from walltopo_lab.train.sets import LabelledSet

HOLD, VOLUME = 1, 2
_TYPES = ("Crimp", "Edge", "Foothold", "Jug", "Pinch", "Pocket", "Rail", "Sloper")


@dataclass(frozen=True)
class Source:
    """One labelled set of the data folder.

    Parameters
    ----------
    folder : within the data folder.
    kind : `yolo` boxes, COCO `outlines` or COCO `boxes`.
    share : share of the crops that this set gives; shares are scaled to a sum of 1.
    validation : patterns of the sources (`source_of`) that are held out: whole gyms.
    held_out : share of the other sources held out; copies and visits stay together.
    volumes_labelled : False where only holds are labelled.
    """

    folder: str
    kind: Literal["yolo", "outlines", "boxes"]
    share: float
    validation: tuple[str, ...] = ()
    held_out: float = 0.0
    volumes_labelled: bool = True

    @property
    def name(self) -> str:
        return self.folder.replace("/", "-")


SOURCES = (
    # Three gyms as a whole. The held-out share is that of the network of July 2026: one gym has
    # three quarters of the photos, and leaving it out would leave too little to learn from.
    Source("hold-boxes/train", "yolo", 0.6, ("img[0-9]*", "wall_img_*", "swall_*"), 0.08),
    # One gym has the numbers 20 to 34; these eight photos are of other gyms.
    Source(
        "hold-polygons",
        "outlines",
        0.12,
        tuple(f"training_{k}_*" for k in ("1", "5", "11", "17", "19", "39", "43", "46")),
    ),
    # All photos `rockwall*` but two are of one gym.
    Source(
        "hold-boxes-2",
        "boxes",
        0.08,
        ("Screenshot-2024-07-18-23[45][0-4]*", "rockwall2_*", "rockwallrockville*"),
    ),
    # One gym, held out as a whole. Its grey volumes are not labelled.
    Source("holds-liam", "yolo", 0.0, ("*",), volumes_labelled=False),
)
RENDERED_SHARE = 0.2

_POLYGONS = {1: HOLD, 2: VOLUME, 4: DONT_KNOW}  # 3, markers (tape, start cards), is background
_BOXES = {**dict.fromkeys(_TYPES, HOLD), "Rock-Climbing-Holds-82mU": HOLD, "Volume": VOLUME}


@dataclass(frozen=True)
class Part:
    """Photos that are reported together.

    Parameters
    ----------
    photos : cache folder and name of each.
    exact : of each, whether its outlines were drawn, so that masks can be measured.
    """

    name: str
    photos: tuple[tuple[Path, str], ...]
    exact: tuple[bool, ...]


# How many photos of each part a quick check looks at, evenly drawn.
QUICK_CHECK = {
    "hold-boxes-train": 12,
    "hold-boxes-train, whole gyms": 12,
    "hold-polygons": 8,
    "hold-boxes-2": 3,
    "holds-liam": 5,
}


def _prepare(source: Source, data: Path, folder: Path, progress: Progress) -> list[str]:
    path = data / source.folder
    annotations, photos = path / "annotations.json", path / "images"
    if not photos.is_dir():
        raise InputError(f"{path}: no such labelled set", "Name the data folder with DATA=FOLDER.")
    if source.kind == "yolo":
        return cache_yolo(path, folder, progress, source.volumes_labelled)
    if source.kind == "boxes":
        return cache_boxes(annotations, photos, folder, _BOXES, progress)
    return cache_coco(annotations, photos, folder, progress, _POLYGONS)


def is_validation(source: Source, name: str) -> bool:
    """Whether a photo belongs to a gym that is held out as a whole."""
    return any(fnmatch(source_of(name), pattern) for pattern in source.validation)


def open_shipped_sets(
    data: Path, rendered: Path, cache: Path, progress: Progress
) -> tuple[list[LabelledSet], list[float]]:
    """Prepare all sets; returns them with the share of the crops that each gives.

    Parameters
    ----------
    rendered : folder of gyms of `walltopo synth`.

    Raises
    ------
    InputError : a set is missing.
    """
    sets, shares = [], []
    for source in SOURCES:
        folder = cache / source.name
        names = _prepare(source, data, folder, progress)
        gyms = [n for n in names if is_validation(source, n)]
        train, kept = split_sources([n for n in names if n not in set(gyms)], source.held_out)
        exact = source.kind == "outlines"
        held_out = tuple(kept + gyms)
        sets.append(LabelledSet(source.name, folder, exact, tuple(train), held_out))
        shares.append(source.share if train else 0.0)
    found = sorted(rendered.glob("*/truth/masks.json"))
    for file in found:
        gym = file.parents[1]
        folder = cache / f"rendered-{gym.name}"
        names = cache_coco(file, gym / "photos", folder, progress)
        sets.append(LabelledSet(folder.name, folder, True, tuple(names), ()))
        shares.append(RENDERED_SHARE / len(found))
    total = sum(shares)
    return sets, [share / total for share in shares]


def validation_parts(sets: Sequence[LabelledSet]) -> list[Part]:
    """Return the validation photos by set; whole gyms of a set that also trains are a part."""
    known = {source.name: source for source in SOURCES}
    parts = []
    for item in sets:
        source = known.get(item.name)
        if source is None or not item.held_out:
            continue
        gyms = [n for n in item.held_out if is_validation(source, n)]
        others = [n for n in item.held_out if n not in set(gyms)]
        whole = f"{item.name}, whole gyms" if others else item.name
        for name, names in ((item.name, others), (whole, gyms)):
            if names:
                photos = tuple((item.folder, n) for n in names)
                parts.append(Part(name, photos, (item.exact,) * len(photos)))
    return parts
