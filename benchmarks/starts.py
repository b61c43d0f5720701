"""Share of right or flagged starts and tops, on simulated scans of gyms and on a real scan.

    python -m benchmarks.starts fit                the regressions, on gyms 3000 to 3029
    python -m benchmarks.starts choose             other values, on gyms 3030 to 3039
    python -m benchmarks.starts report             the rule, on gyms 1000 to 1019
    python -m benchmarks.starts scan SCAN TRUTH    the rule, on a scan of a rendered gym

Simulated scans come from `walltopo_lab.train.ends.seen`. There the generator's routes start on the
two lowest hand holds, or on one, and end on the highest; every found route counts, false ones
included. In a scan of a rendered gym (`scene.json`), all holds but those of kind `foot` are hand
holds, and a route starts on the two lowest. Its groups of holds are kept; their starts and tops are
found anew.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from walltopo.describe.routes import start_and_top as ends
from walltopo.describe.routes import start_and_top as hands
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.routes import Routes
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.train.ends.fit import Row, ends_anew, fit_ends, fit_hands, rows_of, scans_of
from walltopo_lab.train.ends.seen import SeenGym

NEAR = 0.12  # metres: a found hold this near to a true one matches it
FITTED, CHOSEN, REPORTED = range(3000, 3030), range(3030, 3040), range(1000, 1020)


HEAD = ("| end | routes | right | flagged | right or flagged |", "|---|---|---|---|---|")


def _line(kind: str, right: Sequence[bool], flagged: Sequence[bool]) -> str:
    """Return a row of the table: shares of the starts or tops."""
    safe = [a or b for a, b in zip(right, flagged, strict=True)]
    shares = " | ".join(f"{float(np.mean(values)):.3f}" for values in (right, flagged, safe))
    return f"| {kind} | {len(right)} | {shares} |"


def figures(rows: Sequence[Row]) -> list[str]:
    """Return the rows of right, flagged, and right or flagged starts and tops."""
    starts = [row.ends.start_confidence.confidence < ends.MIN_CONFIDENCE for row in rows]
    tops = [row.ends.top_confidence.confidence < ends.MIN_CONFIDENCE for row in rows]
    right = [row.start for row in rows], [row.top for row in rows]
    return [
        _line("start", right[0], starts),
        _line("top", right[1], tops),
        _line("both", right[0] + right[1], starts + tops),
    ]


def of_simulated(scans: Iterable[SeenGym]) -> list[Row]:
    """Return the routes of simulated scans."""
    return [row for seen in scans for row in rows_of(seen)]


def of_scan(scan: ScanFolder, truth: Path) -> list[str]:
    """Return a scan's figures: each true route against the found one with most of its holds."""
    raw = Holds.load(scan.holds_raw)
    routes = Routes.load(scan.routes_raw).routes
    found = ends_anew(routes, raw.holds, raw.left_out)
    rows: dict[str, list[tuple[bool, bool]]] = {"start": [], "top": []}
    for members in _true_routes(scan, raw.holds, truth):
        known = {number for number, _ in members}
        best = max(range(len(routes)), key=lambda k: len(known.intersection(routes[k].holds)))
        # A hold that was not found (None) cannot be a start or top.
        climbed = [number for number, kind in members if kind != "foot"]
        start, top = {hold.id for hold in found[best].start}, found[best].top.id
        flags = bool(found[best].start_confidence.reason), bool(found[best].top_confidence.reason)
        rows["start"].append((start == set(climbed[:2]), flags[0]))
        rows["top"].append((top == climbed[-1], flags[1]))
    rows["both"] = rows["start"] + rows["top"]
    return [_line(kind, *zip(*pairs, strict=True)) for kind, pairs in rows.items()]


def _true_routes(
    scan: ScanFolder, holds: Sequence[Hold], truth: Path
) -> list[list[tuple[int | None, str]]]:
    """Return each true route from bottom to top: the found hold (None if missed) and its kind."""
    exact = read_truth(truth)
    frame = align_views(scan_views(scan, exact), exact.views, similarity=False)
    places = frame.apply(np.array([hold.position for hold in holds]))
    true: dict[int, list[tuple[float, int | None, str]]] = defaultdict(list)
    for item in json.loads((truth / "scene.json").read_text(encoding="utf-8"))["instances"]:
        away = np.linalg.norm(places - item["position"], axis=1)
        number = holds[int(away.argmin())].id if away.min() < NEAR else None
        if item["route"] >= 0:
            true[item["route"]].append((item["position"][2], number, item["kind"]))
    return [
        [(number, kind) for _, number, kind in sorted(members, key=lambda member: member[0])]
        for members in true.values()
    ]


def fit() -> None:
    """Print the regression weights for `walltopo.describe.routes.start_and_top`."""
    scans = scans_of(FITTED)
    found = fit_hands(scans)
    print(f"HAND_WEIGHTS = {tuple(found.weights.values())}\nHAND_BIAS = {found.bias}")
    # Fit starts and tops on the hand holds that this new fit recognises.
    hands.HAND_WEIGHTS, hands.HAND_BIAS = tuple(found.weights.values()), found.bias  # type: ignore[assignment]
    both = fit_ends(of_simulated(scans))
    for name, regression in {"START": both.start, "TOP": both.top}.items():
        print(f"{name}_WEIGHTS = {json.dumps(regression.weights)}\n{name}_BIAS = {regression.bias}")


def choose() -> None:
    """Print the figures of other values of `MIN_CONFIDENCE` and `RISE`."""
    scans = scans_of(CHOSEN)
    for rise in (1.3, 1.6, 1.9):
        ends.RISE = rise
        rows = of_simulated(scans)
        for sure in (0.6, 0.65, 0.7, 0.75, 0.8):
            ends.MIN_CONFIDENCE = sure
            print(f"rise {rise}, sure {sure}", *figures(rows), sep="\n")


def main() -> None:
    if sys.argv[1:] == ["fit"]:
        fit()
    elif sys.argv[1:] == ["choose"]:
        choose()
    elif sys.argv[1:] == ["report"]:
        print(*HEAD, *figures(of_simulated(scans_of(REPORTED))), sep="\n")
    elif sys.argv[1:2] == ["scan"] and len(sys.argv) == 4:
        print(*HEAD, *of_scan(ScanFolder(sys.argv[2]), Path(sys.argv[3])), sep="\n")
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
