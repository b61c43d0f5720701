"""Choose the defaults of `routes` on generated layouts.

    python -m benchmarks.routes_choose [TRIALS]
    python -m benchmarks.routes_choose paint

Without a word: random search over the four settings, then printed: the best ones and the
current default, mean and worst adjusted Rand index over 60 layouts that no figure is reported
on. `paint`: the settings of `link = "paint"` on layouts under very uneven light, and naming
colours first there.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import adjusted_rand_score

from benchmarks.colours_choose import PAINTS, seen_paint
from benchmarks.routes_layouts import Layout, make_layout
from walltopo.routes.colour import HoldPaint, assign_colours, find_palette
from walltopo.routes.grouping import group_by_paint, group_holds
from walltopo.routes.oklab import features, linear_from_srgb8
from walltopo.routes.params import ClassifySettings, RoutesSettings

Floats = NDArray[np.float64]


def score(layout: Layout, settings: RoutesSettings) -> float:
    """ARI of one layout; paths on an unrolled wall are straight."""
    points = np.column_stack(
        [layout.points[:, 0], np.zeros(len(layout.points)), layout.points[:, 1]]
    )
    flat = points * np.array([1, 1, settings.flatten_ratio])
    grouping = group_holds(
        points,
        [str(c) for c in layout.colour],
        lambda pairs: np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1),
        near=settings.min_hold_dist,
        far=settings.max_hold_dist,
        ratio=settings.flatten_ratio,
        resolution=settings.resolution,
    )
    return float(adjusted_rand_score(layout.route, grouping.group))


def evaluate(settings: RoutesSettings, layouts: list[Layout]) -> tuple[float, float]:
    """Mean and worst ARI."""
    values = [score(layout, settings) for layout in layouts]
    return float(np.mean(values)), float(np.min(values))


def uneven(seed: int) -> tuple[Layout, Floats]:
    """A layout and the (n, 3) linear colours of its holds, in patches of light and shade."""
    layout = make_layout(seed)
    rng = np.random.default_rng([41, seed])
    names = rng.permutation(list(PAINTS)).tolist()
    points = layout.points
    spots = rng.uniform(points.min(axis=0), points.max(axis=0), (12, 2))
    away = ((points[:, None] - spots[None]) ** 2).sum(axis=2)
    light = np.exp(-away / 2.9) @ rng.normal(0, 0.5, 12) + rng.normal(0, 0.25, len(points))
    linear = np.zeros((len(points), 3))
    for number in np.unique(layout.colour):
        rows = layout.colour == number
        base = linear_from_srgb8(np.array(PAINTS[names[number]][0], dtype=np.uint8))
        linear[rows] = seen_paint(base, rng, light[rows])
    return layout, linear * 0.8 / np.percentile(linear.mean(axis=1), 98)


def by_paint(layout: Layout, linear: Floats, settings: RoutesSettings) -> float:
    """ARI of `link = "paint"`, or of naming colours first."""
    points = np.column_stack(
        [layout.points[:, 0], np.zeros(len(layout.points)), layout.points[:, 1]]
    )
    flat = points * np.array([1, 1, settings.flatten_ratio])
    reach: dict[str, Any] = {
        "near": settings.min_hold_dist,
        "far": settings.max_hold_dist,
        "ratio": settings.flatten_ratio,
    }

    def lengths(pairs: NDArray[np.int64]) -> Floats:
        return np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1)

    if settings.link == "paint":
        paint = features(linear, settings.paint_lightness)
        resolution, spread = settings.paint_resolution, settings.paint_spread
        grouping = group_by_paint(
            points, paint, lengths, spread=spread, resolution=resolution, **reach
        )
    else:
        colours = ClassifySettings()
        scale = {"spread": colours.colour_spread, "lightness_weight": colours.lightness_weight}
        paints = {k: HoldPaint(x, x[None], np.ones(1)) for k, x in enumerate(linear)}
        found = assign_colours(paints, find_palette(paints, set(), **scale), **scale)
        names = [found[k].name for k in paints]
        grouping = group_holds(points, names, lengths, resolution=settings.resolution, **reach)
    return float(adjusted_rand_score(layout.route, grouping.group))


def choose_paint() -> None:
    """Print the settings of `link = "paint"` and their ARI."""
    gyms = [uneven(seed) for seed in range(24)]
    tried = [RoutesSettings()] + [
        RoutesSettings(link="paint", paint_lightness=a, paint_spread=b, paint_resolution=c)
        for a in (0.2, 0.4, 0.7)
        for b in (0.07, 0.1, 0.13)
        for c in (1.0, 3.0, 5.0)
    ]
    for settings in tried:
        values = [by_paint(layout, linear, settings) for layout, linear in gyms]
        print(
            f"link {settings.link}, paint_lightness {settings.paint_lightness}, paint_spread "
            f"{settings.paint_spread}, paint_resolution {settings.paint_resolution}: mean "
            f"{np.mean(values):.3f}, worst {np.min(values):.3f}"
        )


def main() -> None:
    if sys.argv[1:] == ["paint"]:
        choose_paint()
        return
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    layouts = [make_layout(seed) for seed in range(60)]
    rng = np.random.default_rng(0)
    default = RoutesSettings()
    results = [(*evaluate(default, layouts), default)]
    for _ in range(trials):
        near = rng.uniform(0.2, 2.0)
        settings = replace(
            default,
            min_hold_dist=near,
            max_hold_dist=near + rng.uniform(0.2, 2.5),
            flatten_ratio=rng.uniform(0, 0.8),
            resolution=float(np.exp(rng.uniform(np.log(0.1), np.log(2)))),
        )
        results.append((*evaluate(settings, layouts[:20]), settings))
    best = sorted(results[1:], key=lambda result: -result[0])[:12]
    refined = [(*evaluate(result[2], layouts), result[2]) for result in best]
    print(f"{len(layouts)} layouts, {trials} trials; mean, worst ARI, settings")
    for mean, worst, s in [results[0], *sorted(refined, key=lambda r: -r[0])]:
        print(
            f"{mean:.4f} {worst:.4f}  min_hold_dist {s.min_hold_dist:.2f} max_hold_dist "
            f"{s.max_hold_dist:.2f} flatten_ratio {s.flatten_ratio:.2f} "
            f"resolution {s.resolution:.2f}"
        )


if __name__ == "__main__":
    main()
