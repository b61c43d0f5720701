"""Splitting of a set, so that no gym and no copy of a photo lies on both sides."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from walltopo.core import InputError
from walltopo_lab.datasets.model import Dataset, Photo

# Publishers give augmented copies of a photo the same name except for a hash. Photos of one session
# differ only in a number or a time.
_COPY = re.compile(r"\.rf\.[0-9a-f]{8,}$")
_NUMBER = re.compile(r"[-_ ]*\(?\d+\)?$")
_TIME = re.compile(r"^(\d{4})[-_]?(\d{2})[-_]?(\d{2})[-_T]\d{2}[-_]?\d{2}")


def group_of_photo(photo: Photo, pattern: str = "") -> str:
    """Return the group of photos that must stay on the same side of a split as this one.

    The group is the photo's gym if the set names it. Otherwise it is the match of `pattern` (a
    regular expression with one group) in the photo's name, otherwise its folder. Otherwise it is
    the name without the parts that differ within a session: a copy's hash, a running number, the
    time of day after a date.

    Raises
    ------
    InputError : the pattern does not match the name, or is no regular expression with a group.
    """
    if photo.gym:
        return photo.gym
    if pattern:
        try:
            match = re.search(pattern, photo.name)
            if match:
                return match.group(1)
        except (re.error, IndexError) as error:
            raise InputError(f"pattern {pattern!r}: {error}") from error
        raise InputError(f"pattern {pattern!r} does not fit {photo.name}")
    folder, _, name = photo.name.rpartition("/")
    if folder:
        return folder
    stem = _COPY.sub("", name.rsplit(".", 1)[0])
    date = _TIME.match(stem)
    return "-".join(date.groups()) if date else _NUMBER.sub("", stem) or stem


def split(
    dataset: Dataset,
    shares: Mapping[str, float],
    seed: int = 0,
    group: Callable[[Photo], Any] = group_of_photo,
) -> dict[str, Dataset]:
    """Assign whole groups of photos to parts, so that each part nears its share of the objects.

    Groups are assigned, largest first, to the part that lacks most of its share (ties by `seed`).

    Parameters
    ----------
    shares : part name to its share; they are scaled to sum to 1.

    Raises
    ------
    InputError : fewer groups than parts.
    """
    groups: dict[Any, list[Photo]] = {}
    for photo in dataset.photos:
        groups.setdefault(group(photo), []).append(photo)
    if len(groups) < len(shares):
        raise InputError(
            f"{len(groups)} groups of photos cannot fill {len(shares)} parts",
            "Give a pattern that tells gyms apart (--pattern), or fewer parts.",
        )
    total = sum(shares.values())
    if total <= 0 or min(shares.values()) <= 0:
        raise InputError(f"shares must be above 0, got {dict(shares)}")
    sizes = {key: 1 + sum(len(p.annotations) for p in photos) for key, photos in groups.items()}
    whole = sum(sizes.values())
    order = np.random.default_rng(seed).permutation(len(groups))
    keys = sorted((list(groups)[k] for k in order), key=lambda key: -sizes[key])
    filled = dict.fromkeys(shares, 0)
    names: dict[str, set[str]] = {part: set() for part in shares}
    for key in keys:
        # Fill empty parts first, because a part without a photo is useless.
        part = min(shares, key=lambda p: (filled[p] > 0, filled[p] / (whole * shares[p] / total)))
        filled[part] += sizes[key]
        names[part] |= {photo.name for photo in groups[key]}
    return {part: dataset.subset(chosen) for part, chosen in names.items()}
