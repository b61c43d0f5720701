"""Are starts and tops right, or at least flagged? On simulated scans of gyms, and on a real scan.

    python -m walltopo_lab.benchmarks.starts fit                the regressions, on gyms 3000 to 3029
    python -m walltopo_lab.benchmarks.starts choose             other values, on gyms 3030 to 3049
    python -m walltopo_lab.benchmarks.starts report             the rule, on gyms 1000 to 1019
    python -m walltopo_lab.benchmarks.starts scan SCAN TRUTH    the rule, on a scan of a rendered gym

Simulated scans are those of `walltopo_lab.train.ends.seen`. There the generator's routes start on the
two lowest hand holds, or on one, and end on the highest; every route that is found counts, also those
that are none. Of a scan of a rendered gym (`scene.json`), hand holds are those that are no `foot`, a
route starts on the two lowest, and a found route is the true one that most of its holds are of.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.routes import ends, hands
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.routes import Routes
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.train.ends.fit import Row, fit_ends, fit_hands, rows_of, scans_of
from walltopo_lab.train.ends.seen import SeenGym

NEAR = 0.12  # metres: a found hold so near to a true one is it
FITTED, CHOSEN, REPORTED = range(3000, 3030), range(3030, 3050), range(1000, 1020)


def _row(kind: str, right: Sequence[bool], flagged: Sequence[bool]) -> dict[str, Any]:
    safe = [a or b for a, b in zip(right, flagged, strict=True)]
    return {
        "of": kind,
        "routes": len(right),
        "right": round(float(np.mean(right)), 3),
        "flagged": round(float(np.mean(flagged)), 3),
        "right_or_flagged": round(float(np.mean(safe)), 3),
    }


def figures(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Shares of routes whose start, and whose top, are right, flagged, or one of both."""
    starts = [row.ends.start_doubt.sure < ends.SURE for row in rows]
    tops = [row.ends.top_doubt.sure < ends.SURE for row in rows]
    right = [row.start for row in rows], [row.top for row in rows]
    return [
        _row("start", right[0], starts),
        _row("top", right[1], tops),
        _row("both", right[0] + right[1], starts + tops),
    ]


def of_simulated(scans: Iterable[SeenGym]) -> list[Row]:
    """The routes of simulated scans."""
    return [row for seen in scans for row in rows_of(seen)]


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
    rows: dict[str, list[tuple[bool, bool]]] = {"start": [], "top": []}
    for members in true.values():
        known = {number for _, number, _ in members if number is not None}
        route = max(routes, key=lambda route: len(known.intersection(route.holds)))
        climbed = [
            number for _, number, kind in sorted(members, key=lambda m: m[0]) if kind != "foot"
        ]
        # A hold that was not found is none that a route could start on, or end.
        rows["start"].append((set(route.start) == set(climbed[:2]), bool(route.doubtful_start)))
        rows["top"].append((set(route.top) == {climbed[-1]}, bool(route.doubtful_top)))
    rows["both"] = rows["start"] + rows["top"]
    flags = [
        bool(doubt) for route in routes for doubt in (route.doubtful_start, route.doubtful_top)
    ]
    told = [_row(kind, *zip(*found, strict=True)) for kind, found in rows.items()]
    return [*told, {"routes found": len(routes), "ends flagged": round(float(np.mean(flags)), 3)}]


def fit() -> None:
    """Print the regressions, as they stand in `routes.hands` and `routes.ends`."""
    scans = scans_of(FITTED)
    found = fit_hands(scans)
    print(f"HAND_WEIGHTS = {tuple(found.weights.values())}\nHAND_BIAS = {found.bias}")
    # The ends are of hand holds as this fit tells them.
    hands.HAND_WEIGHTS, hands.HAND_BIAS = tuple(found.weights.values()), found.bias  # type: ignore[assignment]
    both = fit_ends(of_simulated(scans))
    for name, regression in {"START": both.start, "TOP": both.top}.items():
        print(f"{name}_WEIGHTS = {json.dumps(regression.weights)}\n{name}_BIAS = {regression.bias}")


def choose() -> None:
    """Print what other values of `SURE`, and of `RISE`, would give."""
    scans = scans_of(CHOSEN)
    for rise in (1.3, 1.6, 1.9):
        ends.RISE = rise
        rows = of_simulated(scans)
        for sure in (0.5, 0.6, 0.65, 0.7, 0.75, 0.8):
            ends.SURE = sure
            print(rise, sure, *map(json.dumps, figures(rows)))


def main() -> None:
    if sys.argv[1:] == ["fit"]:
        fit()
    elif sys.argv[1:] == ["choose"]:
        choose()
    elif sys.argv[1:] == ["report"]:
        for row in figures(of_simulated(scans_of(REPORTED))):
            print(json.dumps(row))
    elif sys.argv[1:2] == ["scan"] and len(sys.argv) == 4:
        for row in of_scan(ScanFolder(sys.argv[2]), Path(sys.argv[3])):
            print(json.dumps(row))
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
