"""The published tables, in one command.

    python -m benchmarks.tables [DATA] [--work DIR] [--scan SCAN] [--gyms N] [--trials N]
        [--photos N] [--only labels,detectors,lift,given,routes,endtoend]

Writes docs/results.md. Every part keeps its figures in DIR (default build/tables) and is not run
again while they are there, so the command can be stopped and repeated, and a part that was not
run says so in the page. The generated gyms of the lift's table are split by gym: settings are
tuned on train gyms only and reported on test gyms; `gym-a` is never tuned on.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.tables_page import write_page
from walltopo.core import Camera, Silent, View
from walltopo.workspace import ScanFolder, read_json, write_json

console = Console()
Row = dict[str, Any]

PRESETS = ("modern", "oldschool-dark")
CLASSES = {1: "hold", 2: "volume"}


def labels_from_paint(data: Path, args: argparse.Namespace) -> Row:
    """Table 1: labels that a painted, reconstruction-like mesh gives, against true masks."""
    from walltopo.datasets.compare import compare
    from walltopo.datasets.model import Annotation, Dataset
    from walltopo.datasets.project import project_labels
    from walltopo.datasets.refine import grabcut, refine_dataset
    from walltopo.evaluate.truth import read_truth

    gym = data / "gym-a"
    exact, painted = read_truth(gym), read_truth(gym / "lift")
    camera = Camera("SIMPLE_RADIAL", 1280, 960, (947.2, 640.0, 480.0, 0.035))
    names = sorted(exact.views)[:60:4]
    views = [View(name, camera, exact.views[name].cam_from_world) for name in names]
    true = project_labels(
        exact.mesh, exact.face_instance, exact.labelled.labels, CLASSES, views, gym / "photos"
    )
    mine = project_labels(
        painted.mesh, painted.face_instance, painted.labelled.labels, CLASSES, views, gym / "photos"
    )
    boxes = Dataset(
        tuple(
            p.with_annotations(tuple(Annotation(a.label, a.box) for a in p.annotations))
            for p in true.photos
        ),
        CLASSES,
    )
    rows: Row = {"photos": len(views)}
    for name, dataset in (
        ("painted mesh", mine),
        ("painted mesh, GrabCut", refine_dataset(mine, grabcut)[0]),
        ("true boxes as masks", boxes),
        ("true boxes, GrabCut", refine_dataset(boxes, grabcut)[0]),
    ):
        figures = compare(dataset, true).as_dict()
        rows[name] = {k: figures[k] for k in ("miou", "miou_objects", "instance_iou", "objects")}
    return rows


def _detect(photos: Sequence[Path], output: Path) -> None:
    from walltopo.detect.detector import open_detector
    from walltopo.detect.params import DetectSettings
    from walltopo.detect.stage import detect_photos

    if not output.is_file():
        detect_photos(photos, open_detector(DetectSettings()), output, Silent())


def detectors(data: Path, args: argparse.Namespace) -> Row:
    """Table 2: the shipped detector on photos it never saw, at its own score threshold."""
    from walltopo.datasets.read import read_dataset
    from walltopo.evaluate.detector import evaluate_detections

    rows: Row = {}
    for name, where in (
        ("hold-boxes/valid", "hold-boxes/valid"),
        ("hold-masks", "hold-masks/annotations.json"),
    ):
        truth = read_dataset(data / where)
        found = args.work / f"detections-{name.replace('/', '-')}.json"
        _detect([photo.path for photo in truth.photos if photo.path], found)
        rows[name] = evaluate_detections(read_dataset(found), truth).as_dict()
    return rows


def _gyms(args: argparse.Namespace, preset: str) -> list[Any]:
    """Two train gyms and the test gyms of a preset, generated, with the detector's masks."""
    from dataclasses import replace

    from walltopo.synth.params import gym_preset
    from walltopo.synth.recipe import Recipe, generate
    from walltopo.tune.walls import Wall

    gyms: list[Any] = []
    for k in range(2 + args.gyms):
        folder = args.work / "gyms" / f"{preset}-{k}"
        gym, photos = gym_preset(preset)
        photos = replace(photos, photos=args.photos, width=1024, height=768)
        recipe = Recipe(gym, photos, seed=7000 + k, preset=preset)
        generate(folder, recipe)
        masks = folder / "detections.json"
        _detect(sorted((folder / "photos").glob("*.jpg")), masks)
        use = "train" if k < 2 else "test"
        console.print(f"{folder.name}: {use}")
        gyms.append(Wall(f"{preset}-{k}", use, folder / "truth", masks=masks))
    return gyms


def _tuned(
    args: argparse.Namespace, train: Sequence[Any], name: str, method: str
) -> dict[str, Any]:
    """Settings of the lift tuned on train walls; the search is kept and goes on."""
    from walltopo.tune.lift_problem import LiftProblem
    from walltopo.tune.study import open_study, results, search

    problem = LiftProblem(train, method, "ap")
    study = open_study(problem, f"sqlite:///{args.work / 'tuning.db'}", f"{name}-{method}", 0)
    search(study, problem, args.trials)
    return results(study, problem).best.values


def _lift_rows(walls: Sequence[Any], settings: Mapping[str, tuple[str, dict[str, Any]]]) -> Row:
    from dataclasses import replace

    from walltopo.evaluate.instances import summarise_instances
    from walltopo.evaluate.overlap import Labelled
    from walltopo.evaluate.semantics import class_of_faces, confusion, semantic_metrics
    from walltopo.lift import LiftParams
    from walltopo.lift.methods import run_method

    rows: Row = {}
    for name, (method, values) in settings.items():
        params = replace(LiftParams(), method=method, **values)
        overlaps, tables, seconds = [], [], 0.0
        for wall in walls:
            begin = time.process_time()
            instances = run_method(wall.mesh, wall.views, params, Silent())
            seconds += time.process_time() - begin
            overlaps.append(wall.overlap(instances))
            weights = wall.mesh.areas * ~wall.carried.ignored
            mine = class_of_faces(Labelled.of(instances))
            tables.append(confusion(mine, class_of_faces(wall.carried.labelled), weights, 3))
        metrics = summarise_instances(overlaps)
        rows[name] = {
            "agnostic": metrics.agnostic.as_dict(),
            "mean": metrics.mean.as_dict(),
            "semantics": semantic_metrics(tables).as_dict(),
            "cpu_seconds": seconds / len(walls),
            "settings": values,
        }
    return rows


def lift(_data: Path, args: argparse.Namespace) -> Row:
    """Table 3: 3D instances and semantics on generated gyms."""
    from walltopo.tune.lift_problem import load_lift_wall

    tables: Row = {}
    tuned: dict[str, dict[str, Any]] = {}
    for preset in PRESETS:
        walls = _gyms(args, preset)
        train = [load_lift_wall(wall) for wall in walls if wall.use == "train"]
        for method in ("literal", "robust"):
            tuned[f"{preset} {method}"] = _tuned(args, train, preset, method)
        test = [load_lift_wall(wall) for wall in walls if wall.use == "test"]
        tables[preset] = _lift_rows(test, _four(tuned, preset))
    write_json(args.work / "tuned.json", tuned)
    return tables


def given_masks(data: Path, args: argparse.Namespace) -> Row:
    """Table 4: the lift alone, on the masks that gym-a comes with; never tuned on."""
    from walltopo.tune.lift_problem import load_lift_wall
    from walltopo.tune.walls import Wall

    gym, kept = data / "gym-a/lift", args.work / "tuned.json"
    settings: dict[str, tuple[str, dict[str, Any]]] = {
        "literal, defaults": ("literal", {}),
        "literal, resolution 10": ("literal", {"resolution": 10.0}),
        "ours, defaults": ("robust", {}),
    }
    if kept.is_file():
        settings |= _four(read_json(kept), "modern")
    tables: Row = {}
    for masks in ("noisy", "clean"):
        wall = Wall("gym-a", "test", gym, masks=gym / f"{masks}.json", cameras=gym / "cameras")
        tables[f"gym-a {masks}"] = _lift_rows([load_lift_wall(wall)], settings)
    return tables


def _four(
    tuned: Mapping[str, dict[str, Any]], preset: str
) -> dict[str, tuple[str, dict[str, Any]]]:
    return {
        "literal, defaults": ("literal", {}),
        "literal, tuned": ("literal", tuned[f"{preset} literal"]),
        "ours, defaults": ("robust", {}),
        "ours, tuned": ("robust", tuned[f"{preset} robust"]),
    }


def routes(data: Path, args: argparse.Namespace) -> Row:
    """Table 5: route ARI with true holds and colours, default settings."""
    from walltopo.tune.routes_problem import RoutesProblem, load_routes_wall
    from walltopo.tune.walls import Wall

    walls = [Wall(name, "test", data / name) for name in ("gym-a", "gym-a-reset")]
    for preset in PRESETS:
        if (args.work / "gyms").is_dir():
            found = sorted((args.work / "gyms").glob(f"{preset}-*"))
            walls += [
                Wall(f.name, "test", f / "truth") for f in found if (f / "truth/gt.npz").is_file()
            ]
    problem = RoutesProblem([load_routes_wall(wall) for wall in walls])
    return problem.evaluate({r.name: r.default for r in problem.ranges})


def end_to_end(data: Path, args: argparse.Namespace) -> Row:
    """Table 6: a scan of gym-a from its photos alone (give the scan folder with --scan)."""
    from walltopo.evaluate.scan import evaluate_scan
    from walltopo.evaluate.truth import read_truth

    scan = ScanFolder(args.scan)
    figures = evaluate_scan(scan, read_truth(data / "gym-a"), similarity=False).figures
    stages = read_json(scan.manifest).get("stages", {}) if scan.manifest.is_file() else {}
    seconds = {name: stage.get("seconds") for name, stage in stages.items()}
    return {"figures": figures, "seconds": seconds}


PARTS: dict[str, Callable[[Path, argparse.Namespace], Row]] = {
    "labels": labels_from_paint,
    "detectors": detectors,
    "lift": lift,
    "given": given_masks,
    "routes": routes,
    "endtoend": end_to_end,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--work", type=Path, default=Path("build/tables"))
    parser.add_argument("--only", default=",".join(PARTS), help="parts, comma-separated")
    parser.add_argument("--scan", type=Path, help="a finished scan of gym-a, for the last table")
    parser.add_argument("--gyms", type=int, default=3, help="test gyms of each preset")
    parser.add_argument("--trials", type=int, default=40, help="of each tuning")
    parser.add_argument("--photos", type=int, default=24, help="of each generated gym")
    parser.add_argument("--output", type=Path, default=Path("docs/results.md"))
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    for name in args.only.split(","):
        kept = args.work / f"{name}.json"
        if kept.is_file() or (name == "endtoend" and args.scan is None):
            continue
        begin = time.perf_counter(), time.process_time()
        figures = PARTS[name](args.data, args)
        wall, cpu = time.perf_counter() - begin[0], time.process_time() - begin[1]
        setup = {"gyms": args.gyms, "trials": args.trials, "photos": args.photos}
        took = {"seconds": wall, "cpu_seconds": cpu}
        write_json(kept, {"figures": figures, "took": took, "setup": setup})
        console.print(f"{name}: {wall:.0f} s, {cpu:.0f} CPU-s")
    parts = {name: read_json(args.work / f"{name}.json") for name in PARTS
             if (args.work / f"{name}.json").is_file()}  # fmt: skip
    write_page(args.output, parts)
    console.print(f"wrote {args.output}")


if __name__ == "__main__":
    main()
