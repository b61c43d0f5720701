"""Labelled sets for training: cached, and split by the origin of the photos."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from walltopo.core import InputError, Progress
from walltopo.core.files import read_json
from walltopo_lab.train.batches import split_sources
from walltopo_lab.train.cache import DONT_KNOW, cache_coco, cache_yolo

# Objects of this category in a COCO file are neither holds nor background.
IGNORED_CATEGORY = "ignored"


@dataclass(frozen=True)
class LabelledSet:
    """One cached and split data set.

    Parameters
    ----------
    name : name of the set.
    folder : the cache (`walltopo_lab.train.cache`).
    exact : whether its masks were drawn or rendered instead of estimated from boxes.
    train, held_out, dropped : names of cached photos.
    """

    name: str
    folder: Path
    exact: bool
    train: tuple[str, ...]
    held_out: tuple[str, ...]
    dropped: tuple[str, ...] = ()


def drop_photos(item: LabelledSet, names: Collection[str]) -> LabelledSet:
    """Return the set without the named photos in its training part."""
    return replace(
        item,
        train=tuple(name for name in item.train if name not in names),
        dropped=tuple(name for name in item.train if name in names),
    )


def _photos_of(annotations: Path) -> Path:
    for folder in (annotations.parent / "photos", annotations.parent / "images"):
        if folder.is_dir():
            return folder
    return annotations.parent


def _category_labels(annotations: Path) -> dict[int, int]:
    """Return the labels of a COCO file's categories: 1 hold, 2 volume, and what is ignored."""
    rows = read_json(annotations).get("categories", [])
    ignored = {row["id"]: DONT_KNOW for row in rows if row["name"] == IGNORED_CATEGORY}
    return {1: 1, 2: 2} | ignored


def open_sets(
    datasets: Sequence[Path], cache: Path, held_out: float, progress: Progress
) -> list[LabelledSet]:
    """Cache data sets in folders of `cache` and split each into training and held-out photos.

    Raises
    ------
    InputError : a set is neither a COCO file nor a YOLO folder, or no set has labels.
    """
    sets = []
    # Rendered photos are a poor proxy for real ones: validate on box sets if there are any.
    only_exact = all(path.suffix == ".json" for path in datasets)
    for path in datasets:
        exact = path.suffix == ".json"
        label = "-".join(path.with_suffix("").parts[-2:])
        # Runs share the cache, so two sets with the same name need separate folders.
        place = hashlib.blake2b(str(path.resolve()).encode(), digest_size=4).hexdigest()
        folder = cache / f"{label}-{place}"
        if exact:
            names = cache_coco(path, _photos_of(path), folder, progress, _category_labels(path))
            share = held_out if only_exact else 0.0
            kept, aside = split_sources(names, share)
            sets.append(LabelledSet(label, folder, True, tuple(kept), tuple(aside)))
        elif (path / "images").is_dir() and (path / "labels").is_dir():
            names = cache_yolo(path, folder, progress)
            kept, aside = split_sources(names, held_out)
            sets.append(LabelledSet(label, folder, False, tuple(kept), tuple(aside)))
        else:
            raise InputError(
                f"{path}: neither a COCO file nor a YOLO folder",
                "A YOLO folder holds images/ and labels/; a COCO set is named by its .json.",
            )
    if not any(s.held_out for s in sets):
        progress.note("no photo is held out: checks look at photos that were trained on")
    if not any(s.train for s in sets):
        raise InputError(f"no labelled photos in {', '.join(str(p) for p in datasets)}")
    return sets
