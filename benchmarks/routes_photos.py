"""Route clustering in single photos: colours from the pixels, paths in the image.

No setting is chosen here. For real photos with hand-drawn masks, figures cover the masks with a
`route_id`. All holds of a photo take part; volumes take part only with a `route_id`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import Silent
from walltopo.describe.classify.observations import load_photo
from walltopo.scans.segmentation import decode_segmentation, parse_segmentation
from walltopo_lab.train.paint.holds import WAYS, PhotoHolds, of_generated, photo_ari, read_holds
from walltopo_lab.train.paint.photos import make_photos, read_photos


def _holds(folder: Path, image: dict[str, Any], entries: list[dict[str, Any]]) -> PhotoHolds:
    width, height = image["width"], image["height"]
    photo = load_photo(folder / "images" / image["file_name"], width, height)
    kept = [e for e in entries if e["category_id"] == 1 or e.get("route_id") is not None]
    shapes = [parse_segmentation(e["segmentation"], str(folder)) for e in kept]
    masks = [decode_segmentation(shape, width, height, 1, 1.0).full() for shape in shapes]
    given = [entry.get("route_id") for entry in kept]
    return read_holds(photo, masks, [None if route is None else int(route) for route in given])


def _routes_line(values: Mapping[str, float]) -> str:
    return ", ".join(f"{WAYS[way]} {value:.3f}" for way, value in values.items())


def report_generated(folder: Path, first: int, count: int) -> None:
    """Print ARI per photo of generated gyms in dim, mixed light, and the means."""
    make_photos(folder, first, count, Silent())
    rows = []
    for photo in read_photos(folder):
        holds = of_generated(photo)
        rows.append({way: photo_ari(holds, way) for way in WAYS})
        print(f"{photo.name} ({len(holds.points)} holds): {_routes_line(rows[-1])}")
    means = {way: float(np.mean([row[way] for row in rows])) for way in WAYS}
    print(f"{len(rows)} photos, mean ARI: {_routes_line(means)}")


def report_masks(folder: Path) -> None:
    """Print ARI per real photo, and the mean weighted by masks."""
    data = json.loads((folder / "annotations.json").read_text(encoding="utf-8"))
    totals = dict.fromkeys(WAYS, 0.0)
    count = 0
    for image in data["images"]:
        entries = [a for a in data["annotations"] if a["image_id"] == image["id"]]
        known = [e["route_id"] for e in entries if e.get("route_id") is not None]
        if not known:
            continue
        holds = _holds(folder, image, entries)
        results = {way: photo_ari(holds, way) for way in WAYS}
        print(
            f"{image['file_name']} ({len(known)} of {len(entries)} masks in "
            f"{len(set(known))} routes): {_routes_line(results)}"
        )
        for way, value in results.items():
            totals[way] += value * len(known)
        count += len(known)
    means = {way: total / count for way, total in totals.items()}
    print(f"{count} masks, ARI: {_routes_line(means)}")
