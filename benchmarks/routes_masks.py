"""Routes in single real photos with hand-drawn masks: colours from the pixels, paths in the image.

Nothing is chosen here. A photo has no scale and no mesh: the unit is the median extent of its
masks over the settings' `typical_hold`, paths are straight lines in the image. Figures are
over the masks that carry a `route_id`; all masks of a photo take part.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import adjusted_rand_score

from walltopo.formats.coco import decode_segmentation
from walltopo.routes.colour import HoldPaint, assign_colours, find_palette
from walltopo.routes.grouping import group_holds
from walltopo.routes.params import ClassifySettings, RoutesSettings
from walltopo.routes.samples import load_photo, paint_of

Floats = NDArray[np.float64]


def _read(
    photo: NDArray[np.uint8], entries: list[dict[str, Any]]
) -> tuple[dict[int, HoldPaint], Floats, Floats]:
    """Paint, centre (n, 2) and extent (n,) in pixels of each mask of a photo."""
    height, width = photo.shape[:2]
    paints, centres, extents = {}, [], []
    for number, entry in enumerate(entries):
        mask = decode_segmentation(entry["segmentation"], width, height, entry["category_id"], 1.0)
        full = mask.full()
        core = cv2.erode(full.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.bool_)
        linear, _ = paint_of(photo[core if core.sum() >= 12 else full])
        rows, columns = np.nonzero(full)
        paints[number] = HoldPaint(linear, linear[None], np.ones(1))
        centres.append([columns.mean(), rows.mean()])
        extents.append(max(mask.bitmap.shape))
    # One exposure for the photo, as `paint_over_views` gives a scan.
    level = np.percentile([float(p.linear.mean()) for p in paints.values()], 98)
    paints = {
        k: HoldPaint(p.linear * 0.8 / level, p.views * 0.8 / level, p.weights)
        for k, p in paints.items()
    }
    return paints, np.array(centres), np.array(extents, dtype=np.float64)


def one_photo(
    photo: NDArray[np.uint8], entries: list[dict[str, Any]], by_truth: bool
) -> tuple[float, int, int]:
    """ARI, number of masks with a route, number of true routes of one photo.

    by_truth : take each route's colour as known, the most frequent name among its masks.
    """
    colours, routes = ClassifySettings(), RoutesSettings()
    scale = {"spread": colours.colour_spread, "lightness_weight": colours.lightness_weight}
    paints, centres, extents = _read(photo, entries)
    volumes = {k for k, entry in enumerate(entries) if entry["category_id"] == 2}
    palette = find_palette(paints, volumes, **scale)
    found = assign_colours(paints, palette, **scale)
    truth = {k: int(e["route_id"]) for k, e in enumerate(entries) if e.get("route_id") is not None}
    names = {k: found[k].name for k in paints}
    if by_truth:
        for route in set(truth.values()):
            members = [k for k in truth if truth[k] == route]
            most = max((names[k] for k in members), key=[names[k] for k in members].count)
            names |= dict.fromkeys(members, most)
    rows = [k for k in paints if k not in volumes or k in truth]
    unit = float(np.median(extents)) / routes.typical_hold
    points = np.column_stack([centres[rows, 0], np.zeros(len(rows)), centres[rows, 1]])
    flat = points * [1, 1, routes.flatten_ratio]
    grouping = group_holds(
        points,
        [names[k] for k in rows],
        lambda pairs: np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1),
        near=routes.min_hold_dist * unit,
        far=routes.max_hold_dist * unit,
        ratio=routes.flatten_ratio,
        resolution=routes.resolution,
    )
    group = dict(zip(rows, grouping.group.tolist(), strict=True))
    ids = sorted(truth)
    ari = adjusted_rand_score([truth[k] for k in ids], [group[k] for k in ids])
    return float(ari), len(ids), len(set(truth.values()))


def report(folder: Path) -> None:
    """Print ARI per photo, and the mean weighted by masks."""
    data = json.loads((folder / "annotations.json").read_text(encoding="utf-8"))
    totals = {False: 0.0, True: 0.0}
    count = 0
    for image in data["images"]:
        entries = [a for a in data["annotations"] if a["image_id"] == image["id"]]
        if not any(entry.get("route_id") is not None for entry in entries):
            continue
        path = folder / "images" / image["file_name"]
        photo = load_photo(path, image["width"], image["height"])
        results = {known: one_photo(photo, entries, known) for known in (False, True)}
        ari, masks, routes = results[False]
        print(
            f"{image['file_name']}: ARI {ari:.3f} ({masks} of {len(entries)} masks in {routes} "
            f"routes); with one colour name a route {results[True][0]:.3f}"
        )
        for known, result in results.items():
            totals[known] += result[0] * masks
        count += masks
    print(
        f"{count} masks: ARI {totals[False] / count:.3f}; with one colour name a route "
        f"{totals[True] / count:.3f}"
    )
