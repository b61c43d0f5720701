"""Choose the defaults of `routes` on generated layouts.

    python -m walltopo_lab.benchmarks.routes_choose [TRIALS]

Random search over the four settings, then printed: the best ones and the current default, mean
and worst adjusted Rand index over 60 layouts that no figure is reported on. The settings of
`link = "paint"` come from `benchmarks/light.py`.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import adjusted_rand_score

from walltopo.routes.contract import RoutesSettings
from walltopo.routes.grouping import group_holds
from walltopo_lab.benchmarks.routes_layouts import Layout, make_layout

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


def main() -> None:
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
