"""The lift's table: variants of the lift on generated gyms, tuned and evaluated on different ones.

Gyms of a preset are numbered. Gym 0 is for tuning, gym 1 chooses among the search's best trials and
the defaults, and the others are only reported on. The work folder keeps gyms, searches and the
detector's masks (under the detector's hash, so that another detector gets another file). A stopped
run resumes.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from walltopo.core import Silent
from walltopo.core.files import hash_path, write_json
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
from walltopo_lab.tune.lift_problem import LiftProblem, LiftWall, load_lift_wall
from walltopo_lab.tune.study import open_study, results, search
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


def detections(
    photos: Sequence[Path], folder: Path, name: str = "detections", score: float = 0.0
) -> Path:
    """Return the file of the shipped detector's masks of some photos, kept under its hash.

    Parameters
    ----------
    score : minimum score; 0 takes the detector's own.
    """
    path = folder / f"{name}-{detector_hash()}.json"
    if not path.is_file():
        found, _ = detect_photos(photos, open_detector(DetectSettings(score=score)), Silent())
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


def test_gyms(plan: Plan, preset: str) -> list[Path]:
    """Return the gyms that are only reported on."""
    return [gym_folder(plan, preset, len(USES) + k) for k in range(plan.gyms)]


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
    problem, judge = LiftProblem(train, method), LiftProblem(val, method)
    name = f"{preset}-{method}-{plan.photos}-{detector_hash()}"
    study = open_study(problem, f"sqlite:///{plan.work / 'tuning.db'}", name, 0)
    search(study, problem, plan.trials)
    found = results(study, problem)
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
        "candidates": [asdict(t) | {"val": v} for t, v in zip(candidates, on_val, strict=True)],
        "importance": found.importance,
        "done": [dict(lifted.done) for lifted in problem.lifted],
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
            "settings": dict(values),
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


def lift_table(plan: Plan) -> Row:
    """Return the tables of the plan's presets; write the searches' results to `tuned.json`."""
    tables: Row = {}
    tuned: dict[str, Row] = {}
    for preset in plan.presets:
        train, val = _walls(plan, preset, "train"), _walls(plan, preset, "val")
        for method in ("literal", "robust"):
            tuned[f"{preset} {method}"] = _tuned(plan, preset, method, train, val)
        del train, val
        tables[preset] = lift_rows(_walls(plan, preset, "test"), ways_to_lift(tuned, preset))
    write_json(plan.work / "tuned.json", tuned)
    return {"tables": tables, "tuned": tuned}
