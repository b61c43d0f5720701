"""A pack: prepared photos of labelled sets in one file, to train where nothing else is.

A pack is a ZIP archive. `pack.json` lists the sets and the settings of the split. Each photo has
three members: `SET/NAME.webp` (the photo), `SET/NAME.png` (the instance map plus 8, 16 bits) and
`SET/NAME.npz` (labels, boxes, hulls).
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress
from walltopo.core.files import atomic_path
from walltopo.images.files import open_picture
from walltopo_lab.train.cache import Sample, open_cache, store_sample
from walltopo_lab.train.sets import LabelledSet

QUALITY = 76  # of WebP
MAX_BYTES = 50_000_000  # size of a pack that is easy to move
_FORMAT = 1
_ID_SHIFT = 8  # instance maps hold small negative values, PNG does not


@dataclass(frozen=True)
class Pack:
    """The contents of an opened pack.

    Parameters
    ----------
    sets : labelled sets, cached.
    shares : share of the crops from each set; None if the pack does not state them.
    """

    sets: tuple[LabelledSet, ...]
    shares: tuple[float, ...] | None


def write_pack(
    path: Path,
    sets: Sequence[LabelledSet],
    progress: Progress,
    quality: int = QUALITY,
    shares: Sequence[float] | None = None,
    redraw: Callable[[Sample], Sample] | None = None,
) -> int:
    """Write cached sets as one file; return its size in bytes.

    Parameters
    ----------
    quality : quality of the photos in WebP, 1 to 100.
    shares : share of the crops from each set, for the training.
    redraw : returns a training photo with better pseudo-masks; not used for drawn or rendered ones.

    Raises
    ------
    InputError : a photo is missing in its cache, or the pack exceeds `MAX_BYTES`.
    """
    facts: dict[str, Any] = {"format": _FORMAT, "shares": shares and list(shares), "sets": []}
    with atomic_path(path) as temporary:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive:
            for item in sets:
                facts["sets"].append(_set_facts(item))
                _write_set(archive, item, progress, quality, redraw)
            archive.writestr("pack.json", json.dumps(facts))
        size = temporary.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"{path}: the pack would have {size / 1e6:.0f} MB, more than "
                f"{MAX_BYTES / 1e6:.0f} MB",
                "Pack fewer sets, or lower --quality.",
            )
    return size


def _write_set(
    archive: zipfile.ZipFile,
    item: LabelledSet,
    progress: Progress,
    quality: int,
    redraw: Callable[[Sample], Sample] | None,
) -> None:
    """Add the photos of a set to the archive."""
    names = [*item.train, *item.held_out]
    progress.step(f"{item.name}: packing", len(names))
    for k, name in enumerate(names):
        sample = open_cache(item.folder, name)
        if redraw is not None and not item.exact and k < len(item.train):
            sample = redraw(sample)
        _write_sample(archive, f"{item.name}/{name}", sample, quality)
        progress.advance()


def _set_facts(item: LabelledSet) -> dict[str, Any]:
    return {
        "name": item.name,
        "exact": item.exact,
        "train": list(item.train),
        "held_out": list(item.held_out),
        "dropped": list(item.dropped),
    }


def _write_sample(archive: zipfile.ZipFile, stem: str, sample: Sample, quality: int) -> None:
    _, photo = cv2.imencode(".webp", np.asarray(sample.image), [cv2.IMWRITE_WEBP_QUALITY, quality])
    shifted = (np.asarray(sample.ids, dtype=np.int32) + _ID_SHIFT).astype(np.uint16)
    _, ids = cv2.imencode(".png", shifted, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    arrays = io.BytesIO()
    np.savez_compressed(arrays, labels=sample.labels, boxes=sample.boxes, hulls=sample.hulls)
    archive.writestr(f"{stem}.webp", photo.tobytes())
    archive.writestr(f"{stem}.png", ids.tobytes())
    archive.writestr(f"{stem}.npz", arrays.getvalue())


def open_pack(path: Path, cache: Path, progress: Progress) -> Pack:
    """Unpack into a folder of `cache`, unless it is there, and return the sets.

    Raises
    ------
    InputError : the file is missing, damaged or no pack.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such pack")
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=6)).hexdigest()
    folder = cache / f"pack-{digest}"
    try:
        with zipfile.ZipFile(path) as archive:
            facts = json.loads(archive.read("pack.json"))
            if facts["format"] != _FORMAT:
                raise ValueError(f"format {facts['format']}, expected {_FORMAT}")
            sets = tuple(_set_of(row, folder) for row in facts["sets"])
            for item in sets:
                _unpack_photos(archive, item, progress)
    except (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: not a pack of `walltopo train pack` ({error})") from error
    shares = facts["shares"]
    return Pack(sets, None if shares is None else tuple(float(share) for share in shares))


def _set_of(row: dict[str, Any], folder: Path) -> LabelledSet:
    parts = [row["name"], *row["train"], *row["held_out"]]
    if any(part in ("", ".", "..") or "/" in part or "\\" in part for part in parts):
        raise ValueError("a name contains a path")
    return LabelledSet(
        row["name"],
        folder / row["name"],
        bool(row["exact"]),
        tuple(row["train"]),
        tuple(row["held_out"]),
        tuple(row["dropped"]),
    )


def _unpack_photos(archive: zipfile.ZipFile, item: LabelledSet, progress: Progress) -> None:
    """Write a set's photos into its cache folder; existing ones are kept."""
    names = [*item.train, *item.held_out]
    item.folder.mkdir(parents=True, exist_ok=True)
    progress.step(f"{item.name}: unpacking", len(names))
    for name in names:
        progress.advance()
        if (item.folder / f"{name}.labels.npz").is_file():
            continue
        stem = f"{item.name}/{name}"
        image = _decode(archive.read(f"{stem}.webp"))[..., ::-1]  # OpenCV encoded BGR
        shifted = _decode(archive.read(f"{stem}.png"))
        ids = (shifted.astype(np.int32) - _ID_SHIFT).astype(np.int16)
        with np.load(io.BytesIO(archive.read(f"{stem}.npz"))) as arrays:
            labels, boxes, hulls = arrays["labels"], arrays["boxes"], arrays["hulls"]
        sample = Sample(name, image.astype(np.uint8), ids, labels, boxes, hulls)
        store_sample(item.folder, sample, "pack")


def _decode(data: bytes) -> NDArray[np.generic]:
    with open_picture(data) as picture:
        return np.array(picture)
