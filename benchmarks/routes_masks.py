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
from walltopo.routes.grouping import group_by_paint, group_holds
from walltopo.routes.oklab import features
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


def _names(
    paints: dict[int, HoldPaint], volumes: set[int], truth: dict[int, int], by_truth: bool
) -> dict[int, str]:
    """Colour of each mask; `by_truth`: one name a route, the most frequent of its masks."""
    colours = ClassifySettings()
    scale = {"spread": colours.colour_spread, "lightness_weight": colours.lightness_weight}
    found = assign_colours(paints, find_palette(paints, volumes, **scale), **scale)
    names = {number: found[number].name for number in paints}
    if by_truth:
        for route in set(truth.values()):
            members = [number for number in truth if truth[number] == route]
            own = [names[number] for number in members]
            names |= dict.fromkeys(members, max(own, key=own.count))
    return names


def one_photo(photo: NDArray[np.uint8], entries: list[dict[str, Any]], way: str) -> float:
    """ARI of one photo.

    way : "colour" and "paint" as in the settings' `link`; "known": "colour" with the colours
        of the routes known.
    """
    routes = RoutesSettings()
    paints, centres, extents = _read(photo, entries)
    volumes = {k for k, entry in enumerate(entries) if entry["category_id"] == 2}
    truth = true_routes(entries)
    rows = [k for k in paints if k not in volumes or k in truth]
    unit = float(np.median(extents)) / routes.typical_hold
    points = np.column_stack([centres[rows, 0], np.zeros(len(rows)), centres[rows, 1]])
    flat = points * [1, 1, routes.flatten_ratio]

    def lengths(pairs: NDArray[np.int64]) -> Floats:
        return np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1)

    near, far = routes.min_hold_dist * unit, routes.max_hold_dist * unit
    reach: dict[str, Any] = {"near": near, "far": far, "ratio": routes.flatten_ratio}
    if way == "paint":
        linear = np.array([paints[k].linear for k in rows])
        paint = features(linear, routes.paint_lightness)
        resolution, spread = routes.paint_resolution, routes.paint_spread
        grouping = group_by_paint(
            points, paint, lengths, spread=spread, resolution=resolution, **reach
        )
    else:
        names = _names(paints, volumes, truth, way == "known")
        labels = [names[k] for k in rows]
        grouping = group_holds(points, labels, lengths, resolution=routes.resolution, **reach)
    group = dict(zip(rows, grouping.group.tolist(), strict=True))
    ids = sorted(truth)
    return float(adjusted_rand_score([truth[k] for k in ids], [group[k] for k in ids]))


def true_routes(entries: list[dict[str, Any]]) -> dict[int, int]:
    """Number of a mask to its route, for masks that carry one."""
    given = {k: entry.get("route_id") for k, entry in enumerate(entries)}
    return {k: int(route) for k, route in given.items() if route is not None}


WAYS = {
    "colour": "colours by name (default)",
    "paint": "link = paint",
    "known": "colours of the routes known",
}


def report(folder: Path) -> None:
    """Print ARI per photo, and the mean weighted by masks."""
    data = json.loads((folder / "annotations.json").read_text(encoding="utf-8"))
    totals = dict.fromkeys(WAYS, 0.0)
    count = 0
    for image in data["images"]:
        entries = [a for a in data["annotations"] if a["image_id"] == image["id"]]
        truth = true_routes(entries)
        if not truth:
            continue
        photo = load_photo(folder / "images" / image["file_name"], image["width"], image["height"])
        results = {way: one_photo(photo, entries, way) for way in WAYS}
        print(
            f"{image['file_name']} ({len(truth)} of {len(entries)} masks in "
            f"{len(set(truth.values()))} routes): "
            + ", ".join(f"{WAYS[way]} {value:.3f}" for way, value in results.items())
        )
        for way, value in results.items():
            totals[way] += value * len(truth)
        count += len(truth)
    means = ", ".join(f"{WAYS[way]} {total / count:.3f}" for way, total in totals.items())
    print(f"{count} masks, ARI: {means}")
