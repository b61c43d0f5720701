"""Matching of holds and routes between two scans around a reset, against truth.

    python -m benchmarks.reset_identity OLD NEW DATA/gym-a DATA/gym-a-reset

OLD and NEW are scans of the two truths, NEW made with `--reference OLD`. A hold truly stays if both
truths contain it at the same place, with the same kind and colour. A matched pair is right if both
of its holds are found on that one (IoU over .5); a staying hold that no scan found is missed. A
pair of two found holds without a true hold in either scan (a tag, a downclimb hold) is counted
apart, neither right nor wrong. A route is wrongly kept if the table for the setter calls it "kept"
or "changed" although the two routes share no true hold.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from walltopo.describe.matching.holds import match_holds
from walltopo.describe.matching.routes import RouteStatus, compare_routes, same_paint
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.routes import Routes
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.routes import match_pairs
from walltopo_lab.evaluate.scan import measured_labels, scan_views
from walltopo_lab.evaluate.truth import TrueInstance, Truth, read_truth

_WITHIN = 0.02  # metres over which truth is carried, as in `walltopo evaluate scan`
_SAME_PLACE = 0.001


@dataclass(frozen=True)
class Side:
    """A scan: its holds by id, its routes, and the true instance of each matched hold."""

    holds: Mapping[int, Hold]
    routes: Mapping[int, Sequence[int]]
    true: Mapping[int, int]
    unit: float


def read_side(folder: Path, truth: Truth) -> Side:
    """Return a scan's data after comparison with its truth."""
    scan = ScanFolder(folder)
    whole = read_mesh(scan.mesh)
    found = measured_labels(scan, whole)
    frame = align_views(scan_views(scan, truth), truth.views, False)
    mesh = frame.mesh(whole.without_guesses())
    carried = carry_truth(truth, mesh, _WITHIN)
    pairs = match_pairs(overlap_with_missing(found, carried, mesh.areas, truth))
    described = Holds.load(scan.holds)
    holds, unit = {hold.id: hold for hold in described.holds}, described.unit
    routes = {route.id: route.holds for route in Routes.load(scan.routes).routes}
    return Side(holds, routes, {k: v for k, v in pairs.items() if k in holds}, unit)


def staying(before: Truth, after: Truth) -> set[tuple[int, int]]:
    """Return pairs of true instances that both scans contain."""
    return {
        (a.id, b.id)
        for a in before.instances.values()
        for b in after.instances.values()
        if _is_same(a, b)
    }


def _is_same(a: TrueInstance, b: TrueInstance) -> bool:
    away = np.linalg.norm(np.subtract(a.position, b.position))
    return (a.kind, a.colour) == (b.kind, b.colour) and bool(away < _SAME_PLACE)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    for name in ("old", "new", "old_truth", "new_truth"):
        parser.add_argument(name, type=Path)
    args = parser.parse_args(arguments)
    truths = read_truth(args.old_truth), read_truth(args.new_truth)
    old, new = read_side(args.old, truths[0]), read_side(args.new, truths[1])
    kept = staying(*truths)
    pairs = match_holds(tuple(old.holds.values()), tuple(new.holds.values()), new.unit)
    painted = {a: b for a, b in pairs.items() if same_paint(old.holds[a], new.holds[b])}
    found = {(a, b) for a, b in kept if a in old.true.values() and b in new.true.values()}
    print(
        f"true: {len(kept)} of {len(truths[0].instances)} stay, {len(found)} of them found in both; "
        f"found in all: {len(old.holds)} before, {len(new.holds)} after"
    )
    for name, made in (("by place and shape", pairs), ("and of one colour", painted)):
        true = {(old.true.get(a), new.true.get(b)) for a, b in made.items()}
        right = true & kept
        nothing = sum(a not in old.true and b not in new.true for a, b in made.items())
        precision = len(right) / max(1, len(made) - nothing)
        print(
            f"{name}: {len(made)} pairs, {len(right)} right, {nothing} of no true hold, "
            f"precision {precision:.3f}, recall {len(right) / max(1, len(kept)):.3f}, "
            f"of what was found in both {len(right & found) / max(1, len(found)):.3f}"
        )
    lines = compare_routes(
        old.routes, tuple(old.holds.values()), new.routes, tuple(new.holds.values()), new.unit
    )
    wrong = 0
    for line in lines:
        if line.route is not None and line.number is not None:
            both = {
                (old.true.get(a), new.true.get(b))
                for a, b in painted.items()
                if a in old.routes[line.route] and b in new.routes[line.number]
            }
            wrong += not both & kept
    fates = {fate.value: sum(line.status == fate for line in lines) for fate in RouteStatus}
    print(
        "routes: "
        + ", ".join(f"{count} {name}" for name, count in fates.items())
        + f"; wrongly kept {wrong}"
    )


if __name__ == "__main__":
    main()
