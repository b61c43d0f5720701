"""Routes in single photos under dim, mixed light: fit what is linked, and check it.

    python -m walltopo_lab.benchmarks.light fit FOLDER      weights of `routes/likeness.py`, cross-validated ARI
    python -m walltopo_lab.benchmarks.light check FOLDER    ARI by name, by paint, and with colours known

FOLDER is what `python -m walltopo_lab.benchmarks.light_photos` made; fit and check want different gyms. A
photo has no scale and no mesh: the unit is the median extent of its masks over the settings'
`typical_hold`, paths are straight lines in the image.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import adjusted_rand_score

from walltopo.holds.colour import HoldPaint, assign_colours, find_palette
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.light import SceneLight
from walltopo.holds.observations import paint_of
from walltopo.imaging.srgb import linear_from_srgb8
from walltopo.routes import paint as likeness
from walltopo.routes.contract import RoutesSettings
from walltopo.routes.grouping import best_louvain, candidate_pairs, group_by_paint, group_holds
from walltopo_lab.benchmarks.light_photos import DimPhoto, read_photos

__all__ = ["WAYS", "PhotoHolds", "ari", "read_holds"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

WAYS = {
    "colour": "colours by name (default)",
    "paint": "link = paint",
    "known": "one colour name a route",
}


@dataclass(frozen=True, eq=False)
class PhotoHolds:
    """The holds of one photo.

    Parameters
    ----------
    points : (n, 3) float64, metres by the size of its masks; y = 0.
    linear : (n, 3) linear RGB under one exposure; tint : (n, 3) of the wall around.
    routes : (n,) true route, None where it is not known.
    """

    points: Floats
    linear: Floats
    tint: Floats
    routes: list[int | None]


def _ring(linear: Floats, free: Bools, rows: Ints, columns: Ints, extent: float) -> Floats:
    """(3,) median linear RGB of the wall around a mask, NaN where there is too little."""
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
    """Paint, place and wall of each mask (h, w) of a photo (h, w, 3)."""
    picture = linear_from_srgb8(photo)
    covered = np.any(masks, axis=0).astype(np.uint8)
    free = cv2.dilate(covered, np.ones((5, 5), np.uint8)) == 0
    linear, wall, centres, extents = [], [], [], []
    for full in masks:
        core = cv2.erode(full.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.bool_)
        linear.append(paint_of(photo[core if core.sum() >= 12 else full])[0])
        rows, columns = np.nonzero(full)
        extents.append(float(max(np.ptp(rows), np.ptp(columns)) + 1))
        wall.append(_ring(picture, free, rows, columns, extents[-1]))
        centres.append([columns.mean(), 0.0, rows.mean()])
    unit = float(np.median(extents)) / RoutesSettings().typical_hold
    points, around = np.array(centres) / unit, np.array(wall)
    around = np.where(np.isnan(around), np.nanmedian(around, axis=0), around)
    light = SceneLight(np.zeros((1, 3)), points, np.zeros(len(points)), 0.0, np.log(around + 0.002))
    paint = np.array(linear)
    # One exposure for the photo, as `paint_over_views` gives a scan.
    paint *= 0.8 / np.percentile(paint.mean(axis=1), 98)
    return PhotoHolds(points, paint, light.tint_at(points, likeness.TINT_RADIUS), routes)


def of_generated(photo: DimPhoto) -> PhotoHolds:
    """Holds of a generated photo, without its volumes."""
    rows = [k for k, volume in enumerate(photo.volume) if not volume]
    masks = [photo.ids == photo.number[k] for k in rows]
    routes = [photo.route[k] if photo.route[k] >= 0 else None for k in rows]
    return read_holds(photo.photo, masks, routes)


def names_of(holds: PhotoHolds, known: bool) -> list[str]:
    """Colour of each hold; `known`: one name a route, the most frequent of its holds."""
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


def straight(points: Floats, pairs: Ints, ratio: float) -> Floats:
    """(P,) straight, flattened distances."""
    flat = points * np.array([1, 1, ratio])
    return np.asarray(np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1))


def score(holds: PhotoHolds, group: Ints) -> float:
    """ARI over the holds whose route is known."""
    rows = [k for k, route in enumerate(holds.routes) if route is not None]
    return float(adjusted_rand_score([holds.routes[k] for k in rows], group[rows]))


def ari(holds: PhotoHolds, way: str) -> float:
    """ARI of one photo by one of `WAYS`, with the defaults."""
    settings = RoutesSettings()
    points, seed = holds.points, settings.seed
    if way == "paint":
        paint = likeness.balanced_paint(holds.linear, holds.tint)
        found = group_by_paint(
            points,
            paint,
            lambda pairs: straight(points, pairs, likeness.FLATTEN),
            unit=1.0,
            resolution=likeness.RESOLUTION,
            seed=seed,
        )
    else:
        ratio = settings.flatten_ratio
        found = group_holds(
            points,
            names_of(holds, way == "known"),
            lambda pairs: straight(points, pairs, ratio),
            near=settings.min_hold_dist,
            far=settings.max_hold_dist,
            ratio=ratio,
            resolution=settings.resolution,
            seed=seed,
        )
    return score(holds, found.group)


def _pairs(holds: PhotoHolds) -> tuple[Ints, Floats, Ints]:
    """Pairs in reach, their cues, and 1 same route, 0 other, -1 unknown."""
    points = holds.points
    pairs = candidate_pairs(points, [""] * len(points), likeness.FLATTEN, likeness.REACH)
    paint = likeness.balanced_paint(holds.linear, holds.tint)
    lengths = straight(points, pairs, likeness.FLATTEN)
    cues = likeness.cues_of(points, paint, pairs, lengths)
    one, two = [[holds.routes[k] for k in pairs[:, side]] for side in (0, 1)]
    same = [-1 if None in (a, b) else int(a == b) for a, b in zip(one, two, strict=True)]
    return pairs, cues, np.array(same)


def _regress(tables: list[tuple[Ints, Floats, Ints]]) -> tuple[Floats, float]:
    cues = np.vstack([cues[same >= 0] for _, cues, same in tables])
    same = np.concatenate([same[same >= 0] for _, _, same in tables])
    spread = cues.std(axis=0)
    model = LogisticRegression(max_iter=1000).fit(cues / spread, same)
    return model.coef_[0] / spread, float(model.intercept_[0])


def _left_out(holds: list[PhotoHolds], part: list[int], sharpen: int, resolution: float) -> str:
    """ARI of each photo by a fit to the other half of the gyms: mean, worst."""
    tables = [_pairs(one) for one in holds]
    fits = [_regress([t for t, p in zip(tables, part, strict=True) if p != k]) for k in (0, 1)]
    values = []
    for one, (pairs, cues, _), side in zip(holds, tables, part, strict=True):
        weights, bias = fits[side]
        link = (1 / (1 + np.exp(-(cues @ weights + bias)))) ** sharpen
        links = np.zeros((len(one.points), len(one.points)))
        links[pairs[:, 0], pairs[:, 1]] = np.where(link < likeness.FAINT, 0, link)
        values.append(score(one, best_louvain(links + links.T, resolution, 0)))
    return f"mean {np.mean(values):.3f}, worst {np.min(values):.3f}"


def fit(photos: list[DimPhoto]) -> None:
    """Print the weights, and ARI on gyms left out of a fit: other settings, other colours."""
    holds = [of_generated(photo) for photo in photos]
    part = [int(photo.name.split("_")[0]) % 2 for photo in photos]
    usual = likeness.SHARPEN, likeness.RESOLUTION
    for sharpen, resolution in [(k, r) for k in (2, 3, 4) for r in (1.5, 2.0, 2.5, 3.0)]:
        told = _left_out(holds, part, sharpen, resolution)
        print(f"sharpen {sharpen}, resolution {resolution}: {told}")
    as_seen = [replace(one, tint=np.ones_like(one.tint)) for one in holds]
    print(f"colours as seen, not balanced by the wall: {_left_out(as_seen, part, *usual)}")
    for way in ("colour", "known"):
        values = [ari(one, way) for one in holds]
        print(f"{WAYS[way]}: mean {np.mean(values):.3f}, worst {np.min(values):.3f}")
    weights, bias = _regress([_pairs(one) for one in holds])
    print(f"WEIGHTS = ({', '.join(f'{w:.3f}' for w in weights)})\nBIAS = {bias:.3f}")


def check(photos: list[DimPhoto]) -> None:
    """Print ARI per photo and the means."""
    rows = []
    for photo in photos:
        holds = of_generated(photo)
        rows.append([ari(holds, way) for way in WAYS])
        told = ", ".join(f"{WAYS[way]} {v:.3f}" for way, v in zip(WAYS, rows[-1], strict=True))
        print(f"{photo.name} ({len(holds.points)} holds): {told}")
    means = ", ".join(
        f"{WAYS[w]} {v:.3f}" for w, v in zip(WAYS, np.mean(rows, axis=0), strict=True)
    )
    print(f"{len(photos)} photos, mean ARI: {means}")


def main() -> None:
    actions = {"fit": fit, "check": check}
    if len(sys.argv) != 3 or sys.argv[1] not in actions:
        raise SystemExit(__doc__)
    photos = read_photos(Path(sys.argv[2]))
    if not photos:
        raise SystemExit(
            f"{sys.argv[2]}: no photos; `python -m walltopo_lab.benchmarks.light_photos` makes them"
        )
    actions[sys.argv[1]](photos)


if __name__ == "__main__":
    main()
