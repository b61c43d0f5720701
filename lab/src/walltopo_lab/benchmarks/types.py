"""Types of holds on generated gyms that trained nothing: by relief, and by a classifier of cutouts.

    python -m walltopo_lab.benchmarks.types scans GYM SCAN [GYM SCAN ...]   on reconstructed meshes
    python -m walltopo_lab.benchmarks.types choose GYM SCAN [GYM SCAN ...]
    python -m walltopo_lab.benchmarks.types MODEL.onnx GYM [GYM ...]
    python -m walltopo_lab.benchmarks.types MODEL.onnx gym-a [DATA]         on the gym of another generator

Each GYM is a folder of `walltopo synth`; for scans it may be DATA/gym-a. Printed: how many holds
are named, and how many of those rightly. `scans`: each SCAN, finished up to `lift`, is of its GYM's
photos; the shipped network of reliefs names the true instances, carried onto the scan's mesh, and
the lifted ones that meet a true one at an IoU over .5. `choose` writes into that network the least
probability from which nine of ten of the lifted ones are named rightly. With a MODEL: by relief,
the shipped network on the true mesh as far as photos see it, with 1.5 mm of noise; by cutouts, all
true masks of a hold, summed by area, at several least confidences.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from walltopo.core import Mesh, Silent
from walltopo.holds.classifier_model import CutoutClassifier, Verdict, judge, open_classifier
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.observe import gather
from walltopo.holds.verdicts import verdicts
from walltopo.meshes.ply import read_mesh
from walltopo.scans.attributes import UNKNOWN
from walltopo.scans.folder import ScanFolder
from walltopo_lab.benchmarks.colours import true_scan
from walltopo_lab.benchmarks.hold_types import MODEL, answers_of, least_certain, types_of
from walltopo_lab.classifier.samples import read_cutouts
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.routes import match_pairs, type_of_kind
from walltopo_lab.evaluate.scan import read_labelled, scan_views
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.onnx_file import set_metadata

Key = tuple[str, int]  # gym and hold
Said = dict[Key, str]
Answers = dict[Key, tuple[str, float]]
HOLD = 1  # class id in the truth
WITHIN = 0.02  # metres over which labels are carried between meshes
LEVELS = (0.0, 0.2, 0.4, 0.6, 0.8)


def true_types(gym: Path) -> dict[int, str]:
    """Type of each hold of a route; volumes and downclimb holds are roles, not types."""
    scene = json.loads((gym / "truth" / "scene.json").read_text(encoding="utf-8"))
    return {
        int(item["id"]): type_of_kind(str(item["kind"]))
        for item in scene["instances"]
        if item["route"] >= 0
    }


def by_relief(gym: Path, truth: dict[int, str]) -> dict[int, str]:
    """What the shipped network says of the holds that photos see."""
    with np.load(gym / "truth" / "gt.npz") as data:
        seen = (data["face_views"] > 0) | (data["face_instance"] == 0)
        vertices = data["vertices"] + np.random.default_rng(0).normal(
            0, 0.0015, data["vertices"].shape
        )
        mesh = Mesh(vertices, data["faces"][seen].astype(np.int32))
        labels = data["face_instance"][seen].astype(np.int32)
    present = sorted(set(np.unique(labels).tolist()) & set(truth))
    return types_of(mesh, labels, present)


def on_scan(gym: Path, folder: Path, certain: float | None) -> list[tuple[Answers, Said]]:
    """What the shipped network says of holds on a scan's mesh, and the truth, twice.

    Of the true instances carried onto the mesh; of the lifted ones that meet a true one.
    """
    truth, scan = read_truth(gym), ScanFolder(folder)
    motion = align_views(scan_views(scan, truth), truth.views, False)
    mesh = motion.mesh(read_mesh(scan.mesh)) if motion else read_mesh(scan.mesh)
    holds = (one for one in truth.instances.values() if one.label == HOLD)
    types = {one.id: type_of_kind(one.kind) for one in holds}
    carried = carry_truth(truth, mesh, WITHIN)
    labels = carried.labelled.face_instance
    there = sorted(set(np.unique(labels).tolist()) & set(types))
    lifted = read_labelled(scan.instances, scan.instance_records)
    pairs = match_pairs(overlap_with_missing(lifted, carried, mesh.areas, truth))
    mine = {found: number for found, number in pairs.items() if number in types}
    whole = answers_of(mesh, labels, there, certain)
    met = answers_of(mesh, lifted.face_instance, sorted(mine), certain)
    both = (whole, {mine[found]: answer for found, answer in met.items()})
    return [
        (
            {(gym.name, number): answer for number, answer in answers.items()},
            {(gym.name, number): types[number] for number in answers},
        )
        for answers in both
    ]


def on_scans(words: list[str], certain: float | None) -> list[tuple[Answers, Said]]:
    """`on_scan` of several, put together."""
    sums: list[tuple[Answers, Said]] = [({}, {}), ({}, {})]
    for gym, folder in zip(words[::2], words[1::2], strict=True):
        for total, part in zip(sums, on_scan(Path(gym), Path(folder), certain), strict=True):
            total[0].update(part[0])
            total[1].update(part[1])
    return sums


def scans(words: list[str]) -> None:
    """Print the figures of reconstructed gyms."""
    titles = ("true instances on the scans' meshes", "lifted instances")
    for title, (answers, truth) in zip(titles, on_scans(words, None), strict=True):
        said = {key: name for key, (name, _) in answers.items()}
        told(title, said, truth)
        for pair, count in sorted(Counter((truth[k], said[k]) for k in truth).items()):
            print(f"  {pair[0]} called {pair[1]}: {count}")


def choose(words: list[str]) -> None:
    """Write the least probability from which nine of ten lifted instances are named rightly."""
    answers, truth = on_scans(words, 0.0)[1]
    sure = np.array([sure if name != UNKNOWN else 0.0 for name, sure in answers.values()])
    right = np.array([name == truth[key] for key, (name, _) in answers.items()])
    set_metadata(MODEL, {"certain": json.dumps(least_certain(sure, right))})


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
    relief: dict[Key, str],
    verdict: dict[Key, Verdict],
) -> None:
    """Print all ways."""
    told("by relief", relief, truth)
    for level in sorted({*LEVELS, classifier.certain}):
        sure = {key: one.name for key, one in verdict.items() if one.confidence >= level}
        said = {key: classifier.meaning(name).type for key, name in sure.items()}
        own = " (the network's own)" if level == classifier.certain else ""
        told(f"by cutouts, confidence from {level}{own}", said, truth)
        both = {key: relief.get(key, "unknown") for key in truth}
        both = {
            k: said.get(k, "unknown") if name == "unknown" else name for k, name in both.items()
        }
        told("  by relief, else by those", both, truth)


def of_another_generator(classifier: CutoutClassifier, data: Path) -> None:
    """The same on `gym-a`: every third photo, the instances' own cutouts as a scan takes them."""
    settings = ClassifySettings()
    views, mesh, labels, _, _ = true_scan(data / "gym-a", True)
    seen, _ = gather(views[::3], data / "gym-a" / "photos", mesh, labels, settings, Silent())
    scene = json.loads((data / "gym-a" / "scene.json").read_text(encoding="utf-8"))
    kinds = {e["id"]: type_of_kind(e["kind"]) for e in scene["instances"] if e["class"] == "hold"}
    said = types_of(mesh, labels, sorted(kinds))
    truth = {("gym-a", number): kinds[number] for number in said}
    relief = {("gym-a", number): name for number, name in said.items()}
    looks = {number: rows for number, rows in seen.items() if number in said}
    found = verdicts(classifier, looks, settings.cutout_weight)
    table(classifier, truth, relief, {("gym-a", number): one for number, one in found.items()})


def main() -> None:
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    if sys.argv[1] in ("scans", "choose"):
        (scans if sys.argv[1] == "scans" else choose)(sys.argv[2:])
        return
    classifier = open_classifier(Path(sys.argv[1]))
    if sys.argv[2] == "gym-a":
        data = Path(sys.argv[3] if len(sys.argv) > 3 else "../shared/data")
        of_another_generator(classifier, data)
        return
    truth: dict[Key, str] = {}
    relief: dict[Key, str] = {}
    verdict: dict[Key, Verdict] = {}
    for word in sys.argv[2:]:
        gym = Path(word)
        types = true_types(gym)
        truth |= {(gym.name, number): name for number, name in types.items()}
        relief |= {(gym.name, n): name for n, name in by_relief(gym, types).items()}
        verdict |= {(gym.name, n): v for n, v in by_cutouts(gym, classifier).items()}
    table(classifier, truth, relief, verdict)


if __name__ == "__main__":
    main()
