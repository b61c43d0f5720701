"""Types of holds on gyms outside the training: by relief, and by a classifier of cutouts.

    python -m benchmarks.types scans GYM SCAN [GYM SCAN ...]   on reconstructed meshes
    python -m benchmarks.types MODEL.onnx GYM [GYM ...]
    python -m benchmarks.types MODEL.onnx gym-a [DATA]         on the gym of another generator

Each GYM is a folder of `walltopo synth`; for scans it may be DATA/gym-a. The output is the number
of named holds, and of those named rightly. `scans`: each SCAN, finished up to `lift`, belongs to
the photos of its GYM. The shipped network of reliefs names the true instances, carried onto the
scan's mesh, and the lifted ones that match a true one at an IoU over .5. With a MODEL: by relief,
the shipped network on the visible part of the true mesh, with 1.5 mm of noise; by cutouts, all true
masks of a hold, summed by area, at several minimum confidences.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.colours import true_scan
from walltopo.core import Mesh, Silent
from walltopo.describe.classify.light import observe
from walltopo.describe.classify.types import shipped_model
from walltopo.describe.settings import ClassifySettings
from walltopo.scans.photos import PhotoSet
from walltopo_lab.classifier.cutout_classifier import (
    CutoutClassifier,
    Verdict,
    judge_cutouts,
    open_classifier,
)
from walltopo_lab.classifier.samples import read_cutouts
from walltopo_lab.classifier.verdicts import classify_cutouts
from walltopo_lab.evaluate.truth import Truth, read_truth
from walltopo_lab.evaluate.types import answers_of, name_types_on_scans, true_types

Key = tuple[str, int]  # gym name and hold id
LEVELS = (0.0, 0.2, 0.4, 0.6, 0.8)


def by_relief(truth: Truth, types: dict[int, str]) -> dict[int, str]:
    """Return the shipped network's types of the holds that photos see."""
    seen = (truth.face_views > 0) | (truth.face_instance == 0)
    noise = np.random.default_rng(0).normal(0, 0.0015, truth.mesh.vertices.shape)
    mesh = Mesh(truth.mesh.vertices + noise, truth.mesh.faces[seen])
    labels = truth.face_instance[seen]
    present = sorted(set(np.unique(labels).tolist()) & set(types))
    answers = answers_of(shipped_model(), mesh, labels, present)
    return {number: name for number, (name, _) in answers.items()}


def scans(words: list[str]) -> None:
    """Print the figures of reconstructed gyms."""
    pairs = [(Path(a), Path(b)) for a, b in zip(words[::2], words[1::2], strict=True)]
    titles = ("true instances on the scans' meshes", "lifted instances")
    for title, found in zip(titles, name_types_on_scans(shipped_model(), pairs), strict=True):
        named_types = {key: name for key, (name, _) in found.answers.items()}
        print_figures(title, named_types, found.truth)
        for pair, count in sorted(
            Counter((found.truth[k], named_types[k]) for k in named_types).items()
        ):
            print(f"  {pair[0]} called {pair[1]}: {count}")


def by_cutouts(gym: Path, classifier: CutoutClassifier) -> dict[int, Verdict]:
    """Return the classifier's verdicts on the holds that photos show well enough."""
    cutouts = read_cutouts([gym], "type", classifier.side)
    chance = classifier.confidences(cutouts.pictures)
    area = (cutouts.pictures != 114).any(axis=3).sum(axis=(1, 2)).astype(np.float64)
    found = {}
    for hold in np.unique(cutouts.hold).tolist():
        rows = np.flatnonzero(cutouts.hold == hold)
        number = int(cutouts.keys[hold].rsplit("/", 1)[1])
        found[number] = judge_cutouts(chance[rows], area[rows], classifier.names)
    return found


def print_figures(title: str, named_types: dict[Key, str], truth: dict[Key, str]) -> None:
    """Print the number of named holds, and of those named rightly."""
    named = [key for key in truth if named_types.get(key, "unknown") != "unknown"]
    right = sum(named_types[key] == truth[key] for key in named)
    print(
        f"{title}: {len(named)} of {len(truth)} named, {right} right "
        f"({right / max(len(named), 1):.3f} of the named, {right / len(truth):.3f} of all)"
    )


def table(
    classifier: CutoutClassifier,
    truth: dict[Key, str],
    relief: dict[Key, str],
    verdict: dict[Key, Verdict],
) -> None:
    """Print the figures by relief, by cutouts, and by both."""
    print_figures("by relief", relief, truth)
    for level in sorted({*LEVELS, classifier.certain}):
        sure = {key: one.name for key, one in verdict.items() if one.confidence >= level}
        named_types = {key: classifier.meaning(name).type for key, name in sure.items()}
        own = " (the network's own)" if level == classifier.certain else ""
        print_figures(f"by cutouts, confidence from {level}{own}", named_types, truth)
        both = {key: relief.get(key, "unknown") for key in truth}
        both = {
            k: named_types.get(k, "unknown") if name == "unknown" else name
            for k, name in both.items()
        }
        print_figures("  by relief, else by those", both, truth)


def of_another_generator(classifier: CutoutClassifier, data: Path) -> None:
    """Print the figures on `gym-a`: every third photo, cutouts of instances as in a scan."""
    settings = ClassifySettings()
    views, mesh, labels, _, _ = true_scan(data / "gym-a", True)
    seen, _ = observe(
        views[::3], PhotoSet(data / "gym-a" / "photos"), mesh, labels, settings, Silent()
    )
    types = true_types(read_truth(data / "gym-a").instances)
    answers = answers_of(shipped_model(), mesh, labels, sorted(types))
    truth = {("gym-a", number): types[number] for number in answers}
    relief = {("gym-a", number): name for number, (name, _) in answers.items()}
    looks = {number: rows for number, rows in seen.items() if number in answers}
    found = classify_cutouts(classifier, looks, settings.cutout_weight)
    table(classifier, truth, relief, {("gym-a", number): one for number, one in found.items()})


def main() -> None:
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    if sys.argv[1] == "scans":
        scans(sys.argv[2:])
        return
    classifier = open_classifier(Path(sys.argv[1]))
    if sys.argv[2] == "gym-a":
        data = Path(sys.argv[3] if len(sys.argv) > 3 else "../shared/data")
        of_another_generator(classifier, data)
        return
    truth: dict[Key, str] = {}
    relief: dict[Key, str] = {}
    verdict: dict[Key, Verdict] = {}
    for gym in map(Path, sys.argv[2:]):
        exact = read_truth(gym)
        # Volumes and downclimb holds are roles, not types.
        types = {
            k: name
            for k, name in true_types(exact.instances).items()
            if exact.instances[k].route >= 0
        }
        truth |= {(gym.name, number): name for number, name in types.items()}
        relief |= {(gym.name, n): name for n, name in by_relief(exact, types).items()}
        verdict |= {(gym.name, n): v for n, v in by_cutouts(gym, classifier).items()}
    table(classifier, truth, relief, verdict)


if __name__ == "__main__":
    main()
