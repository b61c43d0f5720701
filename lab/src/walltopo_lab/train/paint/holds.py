"""The holds of one photo: paint, position, surrounding wall, and routes by paint or colour name.

A photo has no scale and no mesh. The length unit is the median extent of its masks divided by the
settings' `typical_hold`, and paths are straight lines in the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import adjusted_rand_score

from walltopo.describe.classify.colour import HoldPaint, assign_colours, find_palette
from walltopo.describe.classify.light import TINT_RADIUS
from walltopo.describe.classify.observations import paint_of
from walltopo.describe.routes import grouping as linking
from walltopo.describe.routes.grouping import group_by_paint, group_holds
from walltopo.describe.settings import ClassifySettings, RoutesSettings
from walltopo.images.colour import linear_from_srgb8
from walltopo.scans.pictures import SceneLight
from walltopo.scans.scale import TYPICAL_HOLD
from walltopo_lab.train.paint.photos import DimPhoto

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

WAYS = {
    "colour": "colours by name",
    "paint": "by paint (default)",
    "known": "one colour name a route",
}


@dataclass(frozen=True, eq=False)
class PhotoHolds:
    """The holds of one photo.

    Parameters
    ----------
    points : (n, 3) float64, metres estimated from the mask sizes; y = 0.
    linear : (n, 3) linear RGB under one exposure; tint : (n, 3) of the surrounding wall.
    routes : (n,) true route, None if unknown.
    """

    points: Floats
    linear: Floats
    tint: Floats
    routes: list[int | None]


def _colour_around(linear: Floats, free: Bools, rows: Ints, columns: Ints, extent: float) -> Floats:
    """Return the (3,) median linear RGB of the wall around a mask, NaN with too few pixels."""
    reach = int(max(8, 0.8 * extent))
    box = (
        slice(max(0, rows.min() - reach), rows.max() + reach + 1),
        slice(max(0, columns.min() - reach), columns.max() + reach + 1),
    )
    wall = linear[box][free[box]]
    return np.median(wall, axis=0) if len(wall) > 20 else np.full(3, np.nan)


def read_holds(
    photo: NDArray[np.uint8], masks: Sequence[Bools], routes: list[int | None]
) -> PhotoHolds:
    """Return paint, position and surrounding wall of each mask (h, w) of a photo (h, w, 3)."""
    picture = linear_from_srgb8(photo)
    covered = np.any(masks, axis=0).astype(np.uint8)
    free = cv2.dilate(covered, np.ones((5, 5), np.uint8)) == 0
    linear, wall, centres, extents = [], [], [], []
    for full in masks:
        core = cv2.erode(full.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.bool_)
        linear.append(paint_of(photo[core if core.sum() >= 12 else full])[0])
        rows, columns = np.nonzero(full)
        extents.append(float(max(np.ptp(rows), np.ptp(columns)) + 1))
        wall.append(_colour_around(picture, free, rows, columns, extents[-1]))
        centres.append([columns.mean(), 0.0, rows.mean()])
    unit = float(np.median(extents)) / TYPICAL_HOLD
    points, around = np.array(centres) / unit, np.array(wall)
    around = np.where(np.isnan(around), np.nanmedian(around, axis=0), around)
    light = SceneLight(np.zeros((1, 3)), points, np.log(around + 0.002))
    paint = np.array(linear)
    # One exposure for the photo, as `paint_over_views` applies to a scan.
    paint *= 0.8 / np.percentile(paint.mean(axis=1), 98)
    return PhotoHolds(points, paint, light.tint_at(points, TINT_RADIUS), routes)


def of_generated(photo: DimPhoto) -> PhotoHolds:
    """Return the holds of a generated photo, without its volumes."""
    rows = [k for k, volume in enumerate(photo.volume) if not volume]
    masks = [photo.ids == photo.number[k] for k in rows]
    routes = [photo.route[k] if photo.route[k] >= 0 else None for k in rows]
    return read_holds(photo.photo, masks, routes)


def names_of(holds: PhotoHolds, known: bool) -> list[str]:
    """Return the colour name of each hold; `known`: the most frequent name of its true route."""
    settings = ClassifySettings()
    spread, weight = settings.colour_spread, settings.lightness_weight
    paints = {k: HoldPaint(x, x[None], np.ones(1)) for k, x in enumerate(holds.linear)}
    palette = find_palette(paints, set(), spread=spread, lightness_weight=weight)
    found = assign_colours(paints, palette, spread=spread, lightness_weight=weight)
    names = [found[k].name for k in paints]
    for route in set(holds.routes) - {None} if known else ():
        rows = [k for k, other in enumerate(holds.routes) if other == route]
        own = [names[k] for k in rows]
        common = max(sorted(set(own)), key=own.count)
        names = [common if k in rows else name for k, name in enumerate(names)]
    return names


def straight_distances(points: Floats, pairs: Ints, ratio: float) -> Floats:
    """Return the (P,) straight, flattened distances of pairs."""
    flat = points * np.array([1, 1, ratio])
    return np.asarray(np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1))


def route_ari(holds: PhotoHolds, group: Ints) -> float:
    """Return the ARI over the holds with a known route."""
    rows = [k for k, route in enumerate(holds.routes) if route is not None]
    return float(adjusted_rand_score([holds.routes[k] for k in rows], group[rows]))


def photo_ari(holds: PhotoHolds, way: str) -> float:
    """Return the ARI of one photo by one of `WAYS`, with the default settings."""
    settings = RoutesSettings()
    points, seed = holds.points, settings.seed
    if way == "paint":
        paint = linking.balanced_paint(holds.linear, holds.tint)
        found = group_by_paint(
            points,
            paint,
            lambda pairs: straight_distances(points, pairs, linking.FLATTEN),
            unit=1.0,
            resolution=linking.RESOLUTION,
            seed=seed,
        )
    else:
        ratio = settings.flatten_ratio
        found = group_holds(
            points,
            names_of(holds, way == "known"),
            lambda pairs: straight_distances(points, pairs, ratio),
            near=settings.min_hold_dist,
            far=settings.max_hold_dist,
            ratio=ratio,
            resolution=settings.resolution,
            seed=seed,
        )
    return route_ari(holds, found.group)
