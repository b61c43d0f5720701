"""Routes in single real photos with hand-drawn masks: colours from the pixels, paths in the image.

Nothing is chosen here. Figures are over the masks that carry a `route_id`; all holds of a photo
take part, volumes only where they carry one.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from walltopo.holds.observations import load_photo
from walltopo.scans.detections import decode_segmentation
from walltopo_lab.benchmarks.light import WAYS, PhotoHolds, ari, read_holds


def _holds(folder: Path, image: dict[str, Any], entries: list[dict[str, Any]]) -> PhotoHolds:
    width, height = image["width"], image["height"]
    photo = load_photo(folder / "images" / image["file_name"], width, height)
    kept = [e for e in entries if e["category_id"] == 1 or e.get("route_id") is not None]
    masks = [decode_segmentation(e["segmentation"], width, height, 1, 1.0).full() for e in kept]
    given = [entry.get("route_id") for entry in kept]
    return read_holds(photo, masks, [None if route is None else int(route) for route in given])


def report(folder: Path) -> None:
    """Print ARI per photo, and the mean weighted by masks."""
    data = json.loads((folder / "annotations.json").read_text(encoding="utf-8"))
    totals = dict.fromkeys(WAYS, 0.0)
    count = 0
    for image in data["images"]:
        entries = [a for a in data["annotations"] if a["image_id"] == image["id"]]
        known = [e["route_id"] for e in entries if e.get("route_id") is not None]
        if not known:
            continue
        holds = _holds(folder, image, entries)
        results = {way: ari(holds, way) for way in WAYS}
        print(
            f"{image['file_name']} ({len(known)} of {len(entries)} masks in "
            f"{len(set(known))} routes): "
            + ", ".join(f"{WAYS[way]} {value:.3f}" for way, value in results.items())
        )
        for way, value in results.items():
            totals[way] += value * len(known)
        count += len(known)
    means = ", ".join(f"{WAYS[way]} {total / count:.3f}" for way, total in totals.items())
    print(f"{count} masks, ARI: {means}")
