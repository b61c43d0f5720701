"""The published tables, in one command.

    python -m benchmarks.tables [DATA] [--work DIR] [--scan SCAN] [--gyms N] [--trials N]
        [--photos N] [--presets modern,oldschool-dark] [--again]
        [--only labels,detectors,lift,given,routes,endtoend]
    python -m benchmarks.tables --page     # only write the page

Writes docs/results.md from docs/results/tables-*.json, which keep the figures of every part. A part
with figures of the same detector and plan is not run again without --again. Gyms, detections and
searches stay in DIR (default build/tables). The last table evaluates a scan folder, and is measured
anew with every --scan. The generated gyms of the lift's table are split by gym (see
`benchmarks.tables_lift`); `gym-a` is never tuned on.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.detectors import thresholds
from benchmarks.results import RESULTS, Part, measured_now
from benchmarks.tables_lift import (
    PRESETS,
    Plan,
    detections,
    detector_hash,
    lift_rows,
    lift_table,
    scan_defaults,
    ways_to_lift,
)
from benchmarks.tables_page import write_page
from benchmarks.tables_routes import routes_table
from walltopo.core import Camera, View
from walltopo.core.files import hash_path, read_json
from walltopo.scans.folder import ScanFolder
from walltopo_lab.datasets.model import Annotation, Dataset
from walltopo_lab.evaluate.looks import LOW_SCORE

console = Console()
Row = dict[str, Any]

CLASSES = {1: "hold", 2: "volume"}


def labels_from_paint(data: Path, args: argparse.Namespace) -> Row:
    """Return table 1: labels from a painted, reconstruction-like mesh, against true masks."""
    from walltopo_lab.datasets.compare import compare
    from walltopo_lab.datasets.project import project_labels
    from walltopo_lab.datasets.refine import grabcut, refine_dataset
    from walltopo_lab.evaluate.truth import read_truth

    gym = data / "gym-a"
    exact, painted = read_truth(gym), read_truth(gym / "lift")
    camera = Camera("SIMPLE_RADIAL", 1280, 960, (947.2, 640.0, 480.0, 0.035))
    names = sorted(exact.views)[:60:4]
    views = [View(name, camera, exact.views[name].cam_from_world) for name in names]
    true = project_labels(
        exact.mesh, exact.face_instance, exact.labelled.labels, CLASSES, views, gym / "photos"
    )
    begin = time.process_time()
    mine = project_labels(
        painted.mesh, painted.face_instance, painted.labelled.labels, CLASSES, views, gym / "photos"
    )
    projecting = time.process_time() - begin
    boxes = Dataset(
        tuple(
            p.with_annotations(tuple(Annotation(a.label, a.box) for a in p.annotations))
            for p in true.photos
        ),
        CLASSES,
    )
    rows: Row = {"photos": len(views)}
    ways: dict[str, Callable[[], Dataset]] = {
        "painted mesh": lambda: mine,
        "painted mesh, GrabCut": lambda: refine_dataset(mine, grabcut)[0],
        "true boxes as masks": lambda: boxes,
        "true boxes, GrabCut": lambda: refine_dataset(boxes, grabcut)[0],
    }
    for name, make in ways.items():
        begin = time.process_time()
        dataset = make()
        seconds = time.process_time() - begin + (projecting if name.startswith("painted") else 0.0)
        figures = compare(dataset, true).as_dict()
        rows[name] = {k: figures[k] for k in ("miou", "miou_objects", "instance_iou", "objects")}
        rows[name]["cpu_seconds"] = seconds
    return rows


def detectors(data: Path, args: argparse.Namespace) -> Row:
    """Return table 2: the shipped detector on unseen photos, ranked, and at its own thresholds."""
    from walltopo.segment.detect.detector import open_detector
    from walltopo.segment.settings import DetectSettings
    from walltopo_lab.datasets.read import read_dataset
    from walltopo_lab.evaluate.detector import evaluate_detections

    least = thresholds(open_detector(DetectSettings()))
    rows: Row = {}
    for name, where in (
        ("hold-boxes/valid", "hold-boxes/valid"),
        ("hold-masks", "hold-masks/annotations.json"),
    ):
        truth = read_dataset(data / where)
        photos = [photo.path for photo in truth.photos if photo.path]
        kept = f"detections-{name.replace('/', '-')}"
        found = read_dataset(detections(photos, args.work, kept, LOW_SCORE))
        sure = Dataset(
            tuple(
                p.with_annotations(tuple(a for a in p.annotations if a.score >= least[a.label]))
                for p in found.photos
            ),
            found.classes,
        )
        rows[name] = {
            "ranked": evaluate_detections(found, truth).as_dict(),
            "sure": evaluate_detections(sure, truth).as_dict(),
        }
    return {"sets": rows, "thresholds": {CLASSES[k]: v for k, v in least.items()}}


def _plan(args: argparse.Namespace) -> Plan:
    return Plan(args.work, args.gyms, args.photos, args.trials, tuple(args.presets.split(",")))


def lift(_data: Path, args: argparse.Namespace) -> Row:
    """Return table 3: 3D instances and semantics on generated gyms."""
    return lift_table(_plan(args))


def given_masks(data: Path, args: argparse.Namespace) -> Row:
    """Return table 4: the lift alone, on the masks of gym-a, which no tuning uses."""
    from walltopo_lab.tune.lift_problem import load_lift_wall
    from walltopo_lab.tune.walls import Wall

    gym, kept = data / "gym-a/lift", args.work / "tuned.json"
    settings: dict[str, tuple[str, dict[str, Any]]] = {
        "literal, defaults": ("literal", {}),
        "literal, surest on top": ("literal", {"on_top": "surest"}),
        "literal, resolution 10": ("literal", {"resolution": 10.0}),
        "literal, resolution 10, surest on top": (
            "literal",
            {"resolution": 10.0, "on_top": "surest"},
        ),
        "ours, defaults": ("robust", {}),
        "ours, a scan's defaults": ("robust", scan_defaults()),
    }
    tuned = read_json(kept) if kept.is_file() else {}
    if "modern literal" in tuned:
        settings |= ways_to_lift(tuned, "modern")
    tables: Row = {}
    for masks in ("noisy", "clean"):
        wall = Wall("gym-a", "test", gym, masks=gym / f"{masks}.json", cameras=gym / "cameras")
        tables[f"gym-a {masks}"] = lift_rows([load_lift_wall(wall)], settings)
    return tables


def routes(data: Path, args: argparse.Namespace) -> Row:
    """Return table 5: route ARI with true holds and colours, by default and tuned."""
    return routes_table(data, args.work, args.gyms, args.trials)


def end_to_end(data: Path, args: argparse.Namespace) -> Row:
    """Return table 6: a scan of gym-a from its photos alone (the scan folder of --scan)."""
    from walltopo_lab.evaluate.scan import evaluate_scan
    from walltopo_lab.evaluate.truth import read_truth

    # Omit the stages' seconds, because they depend on the machine's load during the scan.
    figures = evaluate_scan(ScanFolder(args.scan), read_truth(data / "gym-a"), similarity=False)
    return {"figures": figures.figures}


PARTS: dict[str, Callable[[Path, argparse.Namespace], Row]] = {
    "labels": labels_from_paint,
    "detectors": detectors,
    "lift": lift,
    "given": given_masks,
    "routes": routes,
    "endtoend": end_to_end,
}


def _setup(name: str, args: argparse.Namespace) -> Row:
    """Return the inputs of a part's figures besides code; a change makes the figures stale."""
    setup: Row = {}
    if name in ("lift", "routes"):
        setup |= {"gyms": args.gyms, "trials": args.trials}
    if name == "lift":
        setup |= {"photos": args.photos, "presets": args.presets}
    if name in ("lift", "detectors"):
        setup["detector"] = detector_hash()
    if name == "given":
        tuned = args.work / "tuned.json"
        setup["tuned"] = hash_path(tuned) if tuned.is_file() else ""
    return setup


def run_part(name: str, args: argparse.Namespace) -> None:
    """Measure one part, unless its figures exist."""
    kept, setup = RESULTS / f"tables-{name}.json", _setup(name, args)
    if name == "endtoend" and args.scan is None:
        return
    current = kept.is_file() and Part.load(kept).setup == setup
    if name != "endtoend" and current and not args.again:
        return
    measured = measured_now()
    begin = time.perf_counter(), time.process_time()
    figures = PARTS[name](args.data, args)
    wall, cpu = time.perf_counter() - begin[0], time.process_time() - begin[1]
    took = {"seconds": wall, "cpu_seconds": cpu}
    Part(measured=measured, figures=figures, took=took, setup=setup).save(kept)
    console.print(f"{name}: {wall:.0f} s, {cpu:.0f} CPU-s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--work", type=Path, default=Path("build/tables"))
    parser.add_argument("--only", default=",".join(PARTS), help="parts, comma-separated")
    parser.add_argument("--scan", type=Path, help="a finished scan of gym-a, for the last table")
    parser.add_argument("--gyms", type=int, default=3, help="test gyms of each preset")
    parser.add_argument("--trials", type=int, default=30, help="of each tuning")
    parser.add_argument("--photos", type=int, default=32, help="of each generated gym")
    parser.add_argument("--presets", default=",".join(PRESETS), help="of the generated gyms")
    parser.add_argument("--output", type=Path, default=Path("docs/results.md"))
    parser.add_argument("--again", action="store_true", help="run parts that are there, too")
    parser.add_argument("--page", action="store_true", help="only write the page")
    args = parser.parse_args()
    for name in [] if args.page else args.only.split(","):
        args.work.mkdir(parents=True, exist_ok=True)
        run_part(name, args)
    kept = {name: RESULTS / f"tables-{name}.json" for name in PARTS}
    parts = {name: Part.load(path) for name, path in kept.items() if path.is_file()}
    write_page(args.output, parts)
    console.print(f"wrote {args.output}")


if __name__ == "__main__":
    main()
