"""Are starts and tops right, or at least flagged? On simulated scans of gyms, and on a real scan.

    python -m walltopo_lab.benchmarks.starts fit                the regressions, on gyms 3000 to 3029
    python -m walltopo_lab.benchmarks.starts choose             other values, on gyms 3030 to 3039
    python -m walltopo_lab.benchmarks.starts report             the rule, on gyms 1000 to 1019
    python -m walltopo_lab.benchmarks.starts scan SCAN TRUTH    the rule, on a scan of a rendered gym

Simulated scans are those of `walltopo_lab.train.ends.seen`. There the generator's routes start on the
two lowest hand holds, or on one, and end on the highest; every route that is found counts, also those
that are none. Of a scan of a rendered gym (`scene.json`), hand holds are those that are no `foot`, a
route starts on the two lowest. Its groups of holds are kept, their ends are found anew.
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
from walltopo.scans.attributes import Hold, RawAttributes
from walltopo.scans.folder import ScanFolder
from walltopo.scans.routes import Routes
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.train.ends.fit import Row, ends_anew, fit_ends, fit_hands, rows_of, scans_of
from walltopo_lab.train.ends.seen import SeenGym

NEAR = 0.12  # metres: a found hold so near to a true one is it
FITTED, CHOSEN, REPORTED = range(3000, 3030), range(3030, 3040), range(1000, 1020)


HEAD = ("| end | routes | right | flagged | right or flagged |", "|---|---|---|---|---|")


def _line(kind: str, right: Sequence[bool], flagged: Sequence[bool]) -> str:
    """A row of the table: shares of the ends."""
    safe = [a or b for a, b in zip(right, flagged, strict=True)]
    shares = " | ".join(f"{float(np.mean(values)):.3f}" for values in (right, flagged, safe))
    return f"| {kind} | {len(right)} | {shares} |"


def figures(rows: Sequence[Row]) -> list[str]:
    """Shares of routes whose start, and whose top, are right, flagged, or one of both."""
    starts = [row.ends.start_doubt.sure < ends.SURE for row in rows]
    tops = [row.ends.top_doubt.sure < ends.SURE for row in rows]
    right = [row.start for row in rows], [row.top for row in rows]
    return [
        _line("start", right[0], starts),
        _line("top", right[1], tops),
        _line("both", right[0] + right[1], starts + tops),
    ]


def of_simulated(scans: Iterable[SeenGym]) -> list[Row]:
    """The routes of simulated scans."""
    return [row for seen in scans for row in rows_of(seen)]


def of_scan(scan: ScanFolder, truth: Path) -> list[str]:
    """Figures of a scan: each true route against the found one that has most of its holds."""
    raw = RawAttributes.load(scan.attributes_raw)
    routes = Routes.load(scan.routes_raw).routes
    found = ends_anew(routes, raw.instances, raw.left_out)
    rows: dict[str, list[tuple[bool, bool]]] = {"start": [], "top": []}
    for members in _true_routes(scan, raw.instances, truth):
        known = {number for number, _ in members}
        best = max(range(len(routes)), key=lambda k: len(known.intersection(routes[k].holds)))
        # A hold that was not found (None) is none that a route could start on, or end.
        climbed = [number for number, kind in members if kind != "foot"]
        start, top = {hold.id for hold in found[best].start}, found[best].top.id
        flags = bool(found[best].start_doubt.reason), bool(found[best].top_doubt.reason)
        rows["start"].append((start == set(climbed[:2]), flags[0]))
        rows["top"].append((top == climbed[-1], flags[1]))
    rows["both"] = rows["start"] + rows["top"]
    return [_line(kind, *zip(*pairs, strict=True)) for kind, pairs in rows.items()]


def _true_routes(
    scan: ScanFolder, holds: Sequence[Hold], truth: Path
) -> list[list[tuple[int | None, str]]]:
    """Each true route from bottom to top: the found hold, None where there is none, and its kind."""
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
        for sure in (0.6, 0.65, 0.7, 0.75, 0.8):
            ends.SURE = sure
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
