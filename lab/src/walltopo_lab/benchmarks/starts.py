"""Are starts and tops right, or at least flagged? On gyms of the generator, and on a scan.

    python -m walltopo_lab.benchmarks.starts choose             other values, on gyms 3000 to 3019
    python -m walltopo_lab.benchmarks.starts report             the rule, on gyms 1000 to 1019
    python -m walltopo_lab.benchmarks.starts scan SCAN TRUTH    the rule, on a scan of a rendered gym

Holds and routes of the gyms are true; types are told as the shipped network tells them of lifted
instances (`routes_downclimb`), sizes with an error of 15 %. The generator's routes start on the two
lowest hand holds and end on the highest. Of a scan of a rendered gym (`scene.json`), hand holds are
those that are no `foot`, and a found route is the true one that most of its holds are of.
"""

from __future__ import annotations

import json
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace

from walltopo.routes import order
from walltopo.scans.attributes import Hold
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.routes import Route, Routes
from walltopo_lab.benchmarks.routes_downclimb import PRESETS, as_seen
from walltopo_lab.benchmarks.routes_gyms import SetGym, set_gym
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth

NEAR = 0.12  # metres: a found hold so near to a true one is it


@cache
def _gym(seed: int) -> SetGym:
    return set_gym(PRESETS[seed % len(PRESETS)], seed)


def routes_of(seed: int) -> Iterator[tuple[Route, set[int], set[int]]]:
    """Each route of a gym as found, with its true start and top."""
    gym = _gym(seed)
    rng = np.random.default_rng([23, seed])
    seen = [
        replace(hold, size=float(hold.size * rng.normal(1, 0.15)))
        for hold in as_seen([hold for hold in gym.holds if hold.role == "hold"], seed)
    ]
    usual, ceiling = order.usual_size(seen), order.ceiling_of(seen)
    members: dict[int, list[Hold]] = defaultdict(list)
    for hold in seen:
        members[gym.route[hold.id]].append(hold)
    for number, holds in members.items():
        start, top = (
            {hold.id for hold in holds if gym.part[hold.id] == part} for part in ("start", "top")
        )
        if start and top:
            yield order.describe_route(number + 1, holds, usual, ceiling=ceiling), start, top


def _row(kind: str, right: list[bool], flagged: list[bool]) -> dict[str, Any]:
    safe = [a or b for a, b in zip(right, flagged, strict=True)]
    return {
        "of": kind,
        "routes": len(right),
        "right": round(float(np.mean(right)), 3),
        "flagged": round(float(np.mean(flagged)), 3),
        "right_or_flagged": round(float(np.mean(safe)), 3),
    }


def figures(rows: list[tuple[Route, set[int], set[int]]]) -> list[dict[str, Any]]:
    """Shares of routes whose start, and whose top, are right, flagged, or one of both."""
    return [
        _row(
            "start",
            [set(route.start) == start for route, start, _ in rows],
            [bool(route.doubtful_start) for route, _, _ in rows],
        ),
        _row(
            "top",
            [set(route.top) == top for route, _, top in rows],
            [bool(route.doubtful_top) for route, _, _ in rows],
        ),
    ]


def of_gyms(first: int) -> list[dict[str, Any]]:
    """Figures of twenty gyms."""
    return figures([row for seed in range(first, first + 20) for row in routes_of(seed)])


def of_scan(scan: ScanFolder, truth: Path) -> list[dict[str, Any]]:
    """Figures of a scan: each true route against the found one that has most of its holds."""
    scene = json.loads((truth / "scene.json").read_text(encoding="utf-8"))
    holds = Holds.load(scan.holds).holds
    exact = read_truth(truth)
    frame = align_views(scan_views(scan, exact), exact.views, similarity=False)
    places = frame.apply(np.array([hold.position for hold in holds]))
    true: dict[int, list[tuple[float, int | None, str]]] = defaultdict(list)
    for item in scene["instances"]:
        away = np.linalg.norm(places - item["position"], axis=1)
        number = holds[int(away.argmin())].id if away.min() < NEAR else None
        if item["route"] >= 0:
            true[item["route"]].append((item["position"][2], number, item["kind"]))
    routes = Routes.load(scan.routes).routes
    rows = []
    for members in true.values():
        known = {number for _, number, _ in members if number is not None}
        votes = Counter(
            {route.id: len(known.intersection(route.holds)) for route in routes}
        ).most_common(1)
        hands = [
            number for _, number, kind in sorted(members, key=lambda m: m[0]) if kind != "foot"
        ]
        found = next(route for route in routes if route.id == votes[0][0])
        # A hold that was not found is none that a route could start on.
        missing = {-1} if None in (*hands[:2], hands[-1]) else set()
        start = {number for number in hands[:2] if number is not None} | missing
        rows.append((found, start, {hands[-1] or -1}))
    return figures(rows)


def main() -> None:
    if sys.argv[1:] == ["choose"]:
        for rise in (0.7, 1.0, 1.5):
            for level in (0.3, 0.5, 0.7, 0.9):
                order.START_RISE, order.LEVEL = rise, level
                print(rise, level, *map(json.dumps, of_gyms(3000)))
    elif sys.argv[1:] == ["report"]:
        for row in of_gyms(1000):
            print(json.dumps(row))
    elif sys.argv[1:2] == ["scan"] and len(sys.argv) == 4:
        for row in of_scan(ScanFolder(sys.argv[2]), Path(sys.argv[3])):
            print(json.dumps(row))
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
