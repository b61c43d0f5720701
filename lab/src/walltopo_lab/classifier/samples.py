"""Labelled cutouts from a folder per class, from a scan, or from a gym with ground truth."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.files import read_json
from walltopo.images.files import open_picture, read_rgb
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.pictures import Cutouts as StoredCutouts
from walltopo_lab.classifier.cutout_classifier import Meaning, read_classes, square_cutout

# Hold attributes that define a class, for sources with known attributes.
LABELS = ("type", "colour", "colour+type")
PICTURES = (".png", ".jpg", ".jpeg", ".webp")
MIN_PIXELS = 80  # a smaller cutout shows no shape


@dataclass(frozen=True, eq=False)
class Cutouts:
    """Labelled cutouts of holds.

    Parameters
    ----------
    pictures : (n, side, side, 3) uint8 RGB (`cutout_classifier.square_cutout`).
    label : (n,) int64 into `names`.
    hold : (n,) int64, equal for cutouts of one hold, which are never split.
    names : classes; meanings : attributes of those classes that imply more than their name.
    keys : source and name or number of each hold.
    """

    pictures: NDArray[np.uint8]
    label: NDArray[np.int64]
    hold: NDArray[np.int64]
    names: tuple[str, ...]
    meanings: dict[str, Meaning]
    keys: tuple[str, ...] = ()

    def counts(self) -> dict[str, int]:
        """Return the number of holds per class."""
        pairs = {(int(hold), int(label)) for hold, label in zip(self.hold, self.label, strict=True)}
        found = Counter(self.names[label] for _, label in pairs)
        return {name: found[name] for name in self.names}

    def meaning(self, given: Mapping[str, Meaning]) -> Cutouts:
        """Return the same cutouts with the given meanings of classes.

        Raises
        ------
        InputError : `given` has a class without cutouts.
        """
        missing = sorted(set(given) - set(self.names))
        if missing:
            raise InputError(
                f"no cutout of class {', '.join(missing)}", f"There are: {', '.join(self.names)}."
            )
        return replace(self, meanings={**self.meanings, **given})


@dataclass(frozen=True, eq=False)
class _Cutout:
    picture: NDArray[np.uint8]
    name: str
    hold: str
    meaning: Meaning | None


def read_cutouts(sources: Sequence[Path], label: str, side: int) -> Cutouts:
    """Read the cutouts of all sources, each of one of three kinds.

    - a folder with one folder of images per class (alpha = mask; without alpha the whole
      image is the hold), with a `classes.toml` beside them if classes imply more than a type;
    - a scan folder: its `cutouts/` and the attributes of `holds.json`, which include a setter's
      corrections; holds to review and unknown ones are left out;
    - a gym with truth: `photos/`, `truth/masks.json`, `truth/scene.json`.

    Parameters
    ----------
    label : one of `LABELS`: the attributes that define a class, for scans and truth.

    Raises
    ------
    InputError : a source is of no such kind, or all sources together have fewer than two classes.
    """
    found: list[_Cutout] = []
    for source in sources:
        before = len(found)
        found += _read(Path(source), label, side)
        if len(found) == before:
            raise InputError(f"{source}: holds no labelled cutout of {MIN_PIXELS} pixels or more")
    names = tuple(sorted({cutout.name for cutout in found}))
    if len(names) < 2:
        raise InputError(
            f"only the class {names[0]!r} in {', '.join(map(str, sources))}",
            "A classifier needs at least two.",
        )
    holds = {hold: k for k, hold in enumerate(dict.fromkeys(cutout.hold for cutout in found))}
    meanings = {cutout.name: cutout.meaning for cutout in found if cutout.meaning is not None}
    return Cutouts(
        np.stack([cutout.picture for cutout in found]),
        np.array([names.index(cutout.name) for cutout in found]),
        np.array([holds[cutout.hold] for cutout in found]),
        names,
        meanings,
        tuple(holds),
    )


def _read(source: Path, label: str, side: int) -> Iterator[_Cutout]:
    if (source / "truth" / "scene.json").is_file():
        return _of_truth(source, label, side)
    scan = ScanFolder(source)
    if scan.holds.is_file():
        return _of_scan(scan, label, side)
    if source.is_dir() and any(child.is_dir() for child in source.iterdir()):
        return _of_folders(source, side)
    raise InputError(
        f"{source}: neither a folder per class, nor a classified scan, nor a gym with truth"
    )


def _class_of_hold(label: str, colour: str, kind: str, role: str) -> tuple[str, Meaning] | None:
    """Return name and meaning of a hold's class; None if a defining attribute is unknown."""
    if role != "hold":
        return role, Meaning("volume" if role == "volume" else kind, role=role)
    parts = {"colour": colour, "type": kind}
    words = [parts[word] for word in label.split("+")]
    if "unknown" in words or "" in words:
        return None
    with_colour, with_type = "colour" in label, "type" in label
    meaning = Meaning(kind if with_type else "unknown", colour if with_colour else "")
    return " ".join(words), meaning


def _of_folders(source: Path, side: int) -> Iterator[_Cutout]:
    classes = source / "classes.toml"
    meanings = read_classes(classes) if classes.is_file() else {}
    for folder in sorted(child for child in source.iterdir() if child.is_dir()):
        files = sorted(f for f in folder.iterdir() if f.suffix.lower() in PICTURES)
        if not files:
            raise InputError(f"{folder}: a class without pictures ({', '.join(PICTURES)})")
        for file in files:
            picture = _cutout_picture(file, side)
            if picture is not None:
                # As in a scan, cutouts of one hold share the name up to the last underscore.
                hold = f"{folder}/{file.stem.rsplit('_', 1)[0]}"
                yield _Cutout(picture, folder.name, hold, meanings.get(folder.name))


def _cutout_picture(file: Path, side: int) -> NDArray[np.uint8] | None:
    """Return the square image of a cutout file; None if the hold has too few pixels."""
    with prefix_errors(file), open_picture(file) as image:
        pixels = np.asarray(image.convert("RGBA"))
    mask = pixels[..., 3] >= 128
    if np.count_nonzero(mask) < MIN_PIXELS:
        return None
    return square_cutout(pixels[..., :3], mask, side)


def _of_scan(scan: ScanFolder, label: str, side: int) -> Iterator[_Cutout]:
    holds = {hold.id: hold for hold in Holds.load(scan.holds).holds}
    for entry in StoredCutouts.load(scan.cutouts).index:
        hold = holds.get(entry.id)
        if hold is None or hold.review:
            continue
        named = _class_of_hold(label, hold.colour, hold.type, hold.role)
        picture = _cutout_picture(scan.cutouts / entry.file, side) if named else None
        if named and picture is not None:
            yield _Cutout(picture, named[0], f"{scan.root}/{entry.id}", named[1])


def _truth_class(item: dict[str, Any], label: str) -> tuple[str, Meaning] | None:
    role = {-1: "volume", -2: "downclimb"}.get(int(item["route"]), "hold")
    kind = "foothold" if item["kind"] == "foot" else str(item["kind"])
    return _class_of_hold(label, str(item["colour"]), kind, role)


def _of_truth(source: Path, label: str, side: int) -> Iterator[_Cutout]:
    """Yield cutouts from the true masks of the photos."""
    from walltopo.scans.segmentation import decode_segmentation, parse_segmentation

    items = {int(item["id"]): item for item in read_json(source / "truth/scene.json")["instances"]}
    data = json.loads((source / "truth" / "masks.json").read_text(encoding="utf-8"))
    per_image: dict[int, list[dict[str, Any]]] = {}
    for entry in data["annotations"]:
        per_image.setdefault(int(entry["image_id"]), []).append(entry)
    for image in data["images"]:
        picture = read_rgb(source / "photos" / image["file_name"])
        for entry in per_image.get(int(image["id"]), []):
            number = int(entry["instance_id"])
            named = _truth_class(items[number], label)
            if named is None or entry["area"] < MIN_PIXELS:
                continue
            shape = parse_segmentation(entry["segmentation"], f"{source}: {number}")
            mask = decode_segmentation(shape, image["width"], image["height"], 1, 1.0)
            if np.count_nonzero(mask.bitmap) < MIN_PIXELS:
                continue
            x, y = mask.x, mask.y
            height, width = mask.bitmap.shape
            crop = picture[y : y + height, x : x + width]
            yield _Cutout(
                square_cutout(crop, mask.bitmap, side), named[0], f"{source}/{number}", named[1]
            )
