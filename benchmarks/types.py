"""Types of holds on generated gyms that trained nothing: by shape, and by a classifier of cutouts.

    python -m benchmarks.types MODEL.onnx GYM [GYM ...]
    python -m benchmarks.types MODEL.onnx gym-a [DATA]      on the gym of another generator

Each GYM is a folder of `walltopo synth`. By shape: the shipped model on the true mesh as far as
photos see it, with 1.5 mm of noise. By cutouts: all true masks of a hold, summed by area. Printed:
how many holds are named, and how many of those rightly; for cutouts at several least confidences.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from benchmarks.colours import true_scan
from benchmarks.hold_types import name_of_kind
from walltopo.classifier.model import CutoutClassifier, Verdict, judge, open_classifier
from walltopo.classifier.samples import read_cutouts
from walltopo.core import Mesh, Silent
from walltopo.routes.classify import gather
from walltopo.routes.geometry import measure_shapes
from walltopo.routes.hold_type import measures, shipped_model
from walltopo.routes.params import ClassifySettings
from walltopo.routes.verdicts import verdicts

Key = tuple[str, int]  # gym and hold
LEVELS = (0.0, 0.2, 0.4, 0.6, 0.8)


def true_types(gym: Path) -> dict[int, str]:
    """Type of each hold of a route; volumes and downclimb holds are roles, not types."""
    scene = json.loads((gym / "truth" / "scene.json").read_text(encoding="utf-8"))
    return {
        int(item["id"]): "foothold" if item["kind"] == "foot" else str(item["kind"])
        for item in scene["instances"]
        if item["route"] >= 0
    }


def by_shape(gym: Path, truth: dict[int, str]) -> dict[int, str]:
    """What the shipped model says of the holds that photos see."""
    with np.load(gym / "truth" / "gt.npz") as data:
        seen = (data["face_views"] > 0) | (data["face_instance"] == 0)
        vertices = data["vertices"] + np.random.default_rng(0).normal(
            0, 0.0015, data["vertices"].shape
        )
        mesh = Mesh(vertices, data["faces"][seen].astype(np.int32))
        labels = data["face_instance"][seen].astype(np.int32)
    present = sorted(set(np.unique(labels).tolist()) & set(truth))
    shapes = measure_shapes(mesh, labels, present)
    model = shipped_model()
    return {number: model.name(measures(shape, 1.0))[0] for number, shape in shapes.items()}


def by_cutouts(gym: Path, classifier: CutoutClassifier) -> dict[int, Verdict]:
    """What the classifier says of the holds that photos show well enough."""
    cutouts = read_cutouts([gym], "type", classifier.side)
    chance = classifier.confidences(cutouts.pictures)
    area = (cutouts.pictures != 114).any(axis=3).sum(axis=(1, 2)).astype(np.float64)
    found = {}
    for hold in np.unique(cutouts.hold).tolist():
        rows = np.flatnonzero(cutouts.hold == hold)
        number = int(cutouts.keys[hold].rsplit("/", 1)[1])
        found[number] = judge(chance[rows], area[rows], classifier.names)
    return found


def told(title: str, said: dict[Key, str], truth: dict[Key, str]) -> None:
    """Print how many are named and right."""
    named = [key for key in truth if said.get(key, "unknown") != "unknown"]
    right = sum(said[key] == truth[key] for key in named)
    print(
        f"{title}: {len(named)} of {len(truth)} named, {right} right "
        f"({right / max(len(named), 1):.3f} of the named, {right / len(truth):.3f} of all)"
    )


def table(
    classifier: CutoutClassifier,
    truth: dict[Key, str],
    shape: dict[Key, str],
    verdict: dict[Key, Verdict],
) -> None:
    """Print all ways."""
    told("by shape", shape, truth)
    for level in sorted({*LEVELS, classifier.certain}):
        sure = {key: one.name for key, one in verdict.items() if one.confidence >= level}
        said = {key: classifier.meaning(name).type for key, name in sure.items()}
        own = " (the network's own)" if level == classifier.certain else ""
        told(f"by cutouts, confidence from {level}{own}", said, truth)
        both = {key: shape.get(key, "unknown") for key in truth}
        both = {
            k: said.get(k, "unknown") if name == "unknown" else name for k, name in both.items()
        }
        told("  by shape, else by those", both, truth)


def of_another_generator(classifier: CutoutClassifier, data: Path) -> None:
    """The same on `gym-a`: every third photo, the instances' own cutouts as a scan takes them."""
    settings = ClassifySettings()
    views, mesh, labels, _, _ = true_scan(data / "gym-a", True)
    seen, _ = gather(views[::3], data / "gym-a" / "photos", mesh, labels, settings, Silent())
    scene = json.loads((data / "gym-a" / "scene.json").read_text(encoding="utf-8"))
    kinds = {e["id"]: name_of_kind(e["kind"]) for e in scene["instances"] if e["class"] == "hold"}
    shapes = measure_shapes(mesh, labels, sorted(kinds))
    truth = {("gym-a", number): kinds[number] for number in shapes}
    model = shipped_model()
    shape = {key: model.name(measures(shapes[key[1]], 1.0))[0] for key in truth}
    looks = {number: rows for number, rows in seen.items() if number in shapes}
    found = verdicts(classifier, looks, settings.cutout_weight, settings.max_views)
    table(classifier, truth, shape, {("gym-a", number): one for number, one in found.items()})


def main() -> None:
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    classifier = open_classifier(Path(sys.argv[1]))
    if sys.argv[2] == "gym-a":
        data = Path(sys.argv[3] if len(sys.argv) > 3 else "../shared/data")
        of_another_generator(classifier, data)
        return
    truth: dict[Key, str] = {}
    shape: dict[Key, str] = {}
    verdict: dict[Key, Verdict] = {}
    for word in sys.argv[2:]:
        gym = Path(word)
        types = true_types(gym)
        truth |= {(gym.name, number): name for number, name in types.items()}
        shape |= {(gym.name, n): name for n, name in by_shape(gym, types).items()}
        verdict |= {(gym.name, n): v for n, v in by_cutouts(gym, classifier).items()}
    table(classifier, truth, shape, verdict)


if __name__ == "__main__":
    main()
