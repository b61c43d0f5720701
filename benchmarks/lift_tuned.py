"""Instances and semantics of the lift's variants, with settings tuned on other gyms.

    python -m benchmarks.lift_tuned gyms [--work DIR] [--gyms N] [--trials N] [--photos N]
    python -m benchmarks.lift_tuned given DATA     # the masks of gym-a/lift, nothing tuned

Gyms of a preset are numbered. Gym 0 is for tuning, gym 1 chooses among the search's best trials and
the defaults, and the others are only reported on. The work folder keeps gyms, searches and the
detector's masks (under the detector's hash, so that another detector gets another file). A stopped
run resumes. AP ranks all instances. mIoU is of wall, hold and volume, of all instances and, for
our method, of those that a scan shows (`classify.min_score`).
"""

from __future__ import annotations

import argparse
import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from walltopo.core import Silent
from walltopo.core.files import hash_path
from walltopo.describe.settings import ClassifySettings
from walltopo.pipeline.settings import Settings as ScanSettings
from walltopo.segment.detect.detector import open_detector, shipped_model
from walltopo.segment.detect.photos import detect_photos
from walltopo.segment.lift import LiftParams
from walltopo.segment.lift.methods import run_method
from walltopo.segment.settings import DetectSettings
from walltopo_lab.evaluate.instances import summarise_instances
from walltopo_lab.evaluate.operating import at_score, operating_point
from walltopo_lab.evaluate.overlap import Labelled
from walltopo_lab.evaluate.semantics import class_of_faces, confusion, semantic_metrics
from walltopo_lab.synth.params import gym_preset
from walltopo_lab.synth.recipe import Recipe, generate
from walltopo_lab.tune.lift_task import LiftTask, LiftWall, load_lift_wall
from walltopo_lab.tune.study import open_study, run_trials, study_results
from walltopo_lab.tune.walls import Wall

PRESETS = ("modern", "oldschool-dark")
USES = ("train", "val")  # all further gyms: test
FIRST_SEED = 7000  # the shipped detector was trained on gyms 2000 to 2013
SIZE = (1280, 960)
# The validation gym chooses among this many of the search's best trials.
SHORT_LIST = 5

Settings = Mapping[str, tuple[str, Mapping[str, Any]]]
Row = dict[str, Any]
console = Console(stderr=True)


@dataclass(frozen=True)
class Plan:
    """The extent of the work: folder, test gyms, photos a gym, trials a search, presets."""

    work: Path
    gyms: int
    photos: int
    trials: int
    presets: tuple[str, ...] = PRESETS


def detector_hash() -> str:
    """Return a hash of the shipped detector: its weights and the settings that decide its masks."""
    settings = DetectSettings()
    # Include only settings that decide the masks, not those of the place and speed of inference.
    looks = [getattr(settings, name) for name in ("score", "size", "tile", "overlap", "again")]
    text = f"{hash_path(shipped_model())} {looks}"
    return hashlib.blake2b(text.encode(), digest_size=4).hexdigest()


def detections(photos: Sequence[Path], folder: Path) -> Path:
    """Return the file of the shipped detector's masks of some photos, kept under its hash."""
    path = folder / f"detections-{detector_hash()}.json"
    if not path.is_file():
        found, _ = detect_photos(photos, open_detector(DetectSettings()), Silent())
        found.save(path)
    return path


def gym_folder(plan: Plan, preset: str, number: int) -> Path:
    """Return the folder of one gym with its photos, and generate it if absent."""
    gym, photos = gym_preset(preset)
    photos = replace(photos, photos=plan.photos, width=SIZE[0], height=SIZE[1])
    folder = plan.work / "gyms" / f"{preset}-{number}"
    recipe = Recipe(gym, photos, seed=FIRST_SEED + number, preset=preset)
    made = generate(folder, recipe)
    console.print(f"{folder.name}: {made}")
    return folder


def load_wall(plan: Plan, preset: str, number: int) -> LiftWall:
    """Return a gym with its photos and the shipped detector's masks, and make them if absent."""
    folder = gym_folder(plan, preset, number)
    masks = detections(sorted((folder / "photos").glob("*.jpg")), folder)
    use = "train" if USES[number : number + 1] == ("train",) else "test"
    return load_lift_wall(Wall(folder.name, use, folder / "truth", masks=masks))


def _walls(plan: Plan, preset: str, use: str) -> list[LiftWall]:
    uses = USES + ("test",) * plan.gyms
    return [load_wall(plan, preset, k) for k, own in enumerate(uses) if own == use]


def _tuned(
    plan: Plan, preset: str, method: str, train: Sequence[LiftWall], val: Sequence[LiftWall]
) -> Row:
    """Search settings on the train gyms and return the choice of the validation gym."""
    task, judge = LiftTask(train, method), LiftTask(val, method)
    name = f"{preset}-{method}-{plan.photos}-{detector_hash()}"
    study = open_study(task, f"sqlite:///{plan.work / 'tuning.db'}", name, 0)
    run_trials(study, task, plan.trials)
    found = study_results(study, task)
    best = sorted((t for t in found.trials if t.walls), key=lambda t: (-t.figure, t.number))
    candidates = [found.default, *best[:SHORT_LIST]]
    on_val = [float(np.mean(list(judge.evaluate(t.values).values()))) for t in candidates]
    chosen = int(np.argmax(on_val))
    console.print(
        f"{name}: val {on_val[0]:.3f} -> {on_val[chosen]:.3f} {candidates[chosen].values}"
    )
    return {
        "values": candidates[chosen].values,
        "trials": len(found.trials),
        "train": [found.default.figure, candidates[chosen].figure],
        "val": [on_val[0], on_val[chosen]],
    }


def lift_rows(walls: Sequence[LiftWall], settings: Settings) -> Row:
    """Return the figures of each variant of the lift, over all walls together.

    AP ranks all instances. The semantic figures cover all of them and, for the robust method, those
    that a scan shows (`classify.min_score`).
    """
    cut = ClassifySettings().min_score
    rows: Row = {}
    for name, (method, values) in settings.items():
        params = replace(LiftParams(), method=method, **dict(values))  # type: ignore[arg-type]
        overlaps, overlaps_shown, by_wall, seconds = [], [], {}, 0.0
        tables: dict[str, list[Any]] = {"semantics": [], "semantics_shown": []}
        for wall in walls:
            begin = time.process_time()
            found = Labelled.of(run_method(wall.mesh, wall.views, params, Silent()))
            seconds += time.process_time() - begin
            shown = at_score(found, cut)
            overlaps.append(wall.overlap(found))
            overlaps_shown.append(wall.overlap(shown))
            by_wall[wall.name] = summarise_instances(overlaps[-1:]).mean.ap50
            weights = wall.mesh.areas * ~wall.carried.ignored
            true = class_of_faces(wall.carried.labelled)
            for kind, kept in (("semantics", found), ("semantics_shown", shown)):
                tables[kind].append(confusion(class_of_faces(kept), true, weights, 3))
        metrics = summarise_instances(overlaps)
        rows[name] = {
            "agnostic": metrics.agnostic.as_dict(),
            "mean": metrics.mean.as_dict(),
            "semantics": semantic_metrics(tables["semantics"]).as_dict(),
            "by_wall": by_wall,
            "cpu_seconds": seconds / len(walls),
        }
        if method == "robust":
            rows[name]["semantics_shown"] = semantic_metrics(tables["semantics_shown"]).as_dict()
            rows[name]["shown"] = operating_point(overlaps_shown).as_dict()
    return rows


def scan_defaults() -> dict[str, Any]:
    """Return the lift settings of a scan that differ from the library's defaults."""
    library, scan = asdict(LiftParams()), asdict(ScanSettings().lift)
    return {name: value for name, value in scan.items() if value != library[name]}


def ways_to_lift(tuned: Mapping[str, Row], preset: str) -> dict[str, tuple[str, dict[str, Any]]]:
    """Return the rows of the table: name to method and settings."""
    return {
        "literal, defaults": ("literal", {}),
        "literal, surest on top": ("literal", {"on_top": "surest"}),
        "literal, tuned": ("literal", tuned[f"{preset} literal"]["values"]),
        "ours, defaults": ("robust", {}),
        "ours, a scan's defaults": ("robust", scan_defaults()),
        "ours, tuned": ("robust", tuned[f"{preset} robust"]["values"]),
    }


def _three(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def print_variants(tables: Mapping[str, Row]) -> None:
    """Print the figures of each variant of the lift; `tables` maps an input to its `lift_rows`."""
    print(
        "| input | method | mean of classes: AP50 | AP | one class: AP50 | AP | AP25 "
        "| AP .50:.95 (COCO) | mIoU | mIoU shown | precision shown | recall shown | CPU-s |"
    )
    print("|---" * 13 + "|")
    for name, rows in tables.items():
        for method, row in rows.items():
            one, mean, shown = row["agnostic"], row["mean"], row.get("shown", {})
            cells = [mean["ap50"], mean["ap"], one["ap50"], one["ap"], one["ap25"], one["coco_ap"]]
            cells += [row["semantics"]["miou"], row.get("semantics_shown", {}).get("miou")]
            cells += [shown.get("precision"), shown.get("recall")]
            text = " | ".join(map(_three, cells))
            print(f"| {name} | {method} | {text} | {row['cpu_seconds']:.1f} |")


def print_searches(tuned: Mapping[str, Row]) -> None:
    """Print what each search found, by preset and method."""
    print("| search | trials | train: defaults | chosen | val: defaults | chosen | settings |")
    print("|---" * 7 + "|")
    for name, row in tuned.items():
        values = ", ".join(f"{key} {value:.3g}" for key, value in row["values"].items())
        cells = " | ".join(map(_three, (*row["train"], *row["val"])))
        print(f"| {name} | {row['trials']} | {cells} | {values} |")


def print_gyms(rows: Row) -> None:
    """Print AP50, mean of classes, of each variant on each gym."""
    gyms = list(next(iter(rows.values()))["by_wall"])
    print("| AP50, mean of classes | " + " | ".join(gyms) + " |")
    print("|---" * (len(gyms) + 1) + "|")
    for method, row in rows.items():
        print(f"| {method} | " + " | ".join(_three(row["by_wall"][gym]) for gym in gyms) + " |")


def gyms(plan: Plan) -> None:
    """Print the tables of the plan's presets."""
    tables: dict[str, Row] = {}
    tuned: dict[str, Row] = {}
    for preset in plan.presets:
        train, val = _walls(plan, preset, "train"), _walls(plan, preset, "val")
        for method in ("literal", "robust"):
            tuned[f"{preset} {method}"] = _tuned(plan, preset, method, train, val)
        del train, val
        tables[preset] = lift_rows(_walls(plan, preset, "test"), ways_to_lift(tuned, preset))
    print_variants(tables)
    print()
    print_searches(tuned)
    for rows in tables.values():
        print()
        print_gyms(rows)


def given(data: Path) -> None:
    """Print the figures of the lift alone, on the masks of gym-a, which no tuning uses."""
    gym = data / "gym-a/lift"
    coarse = {"resolution": 10.0}
    settings: Settings = {
        "literal, defaults": ("literal", {}),
        "literal, surest on top": ("literal", {"on_top": "surest"}),
        "literal, resolution 10": ("literal", coarse),
        "literal, resolution 10, surest on top": ("literal", coarse | {"on_top": "surest"}),
        "ours, defaults": ("robust", {}),
        "ours, a scan's defaults": ("robust", scan_defaults()),
    }
    tables = {}
    for masks in ("noisy", "clean"):
        wall = Wall("gym-a", "test", gym, masks=gym / f"{masks}.json", cameras=gym / "cameras")
        tables[f"gym-a {masks}"] = lift_rows([load_lift_wall(wall)], settings)
    print_variants(tables)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("given").add_argument("data", type=Path)
    generated = commands.add_parser("gyms")
    generated.add_argument("--work", type=Path, default=Path("build/tables"))
    generated.add_argument("--gyms", type=int, default=3, help="test gyms of each preset")
    generated.add_argument("--photos", type=int, default=32, help="of each generated gym")
    generated.add_argument("--trials", type=int, default=30, help="of each tuning")
    args = parser.parse_args()
    if args.command == "given":
        given(args.data)
    else:
        args.work.mkdir(parents=True, exist_ok=True)
        gyms(Plan(args.work, args.gyms, args.photos, args.trials))


if __name__ == "__main__":
    main()
