"""Accuracy of the lift, and the effect of each of its design choices.

    python -m benchmarks.lift_accuracy given DATA     # the masks of gym-a/lift
    python -m benchmarks.lift_accuracy ablation       # on our own scenes
    python -m benchmarks.lift_accuracy gyms WORK      # on the gyms that lift_tuned tunes on

APs are by face area, classes merged into one, faces that no view sees ignored. There are three
evaluators: "ScanNet" (the protocol of its benchmark), "COCO" (101 recalls, .50:.95), and "every
recall" (COCO's matching, .50:.90, integrated over every reached recall, as in the test data's
README). "as sets" is the result of the publication's Algorithm 7: instances of two classes that may
share triangles, here ranked by the sum of `p.score`. All other rows have one label a triangle;
those of the literal method rank by the mean of `p.score` (`confidence`).
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.lift_scenes import MaskNoise, Scene, make_scene, spoil
from benchmarks.lift_tuned import Plan, lift_rows, load_wall
from walltopo.core import Instances, Mesh, View
from walltopo.scans.coco_import import read_coco_masks
from walltopo.scans.colmap_model import read_views
from walltopo.segment.lift import LiftParams, lift
from walltopo.segment.lift.fast import literal_kept, projection_scores
from walltopo_lab.evaluate.coco_ap import exact_ap
from walltopo_lab.evaluate.instances import ApSummary, summarise_instances
from walltopo_lab.evaluate.overlap import Labelled, Overlap, overlap_of_faces, overlap_of_sets
from walltopo_lab.evaluate.scannet import SCANNET_THRESHOLDS

# Each variant reverts one of our choices, or adds one of ours to the literal method.
ABLATION: dict[str, dict[str, Any]] = {
    "robust (all of the default)": {},
    "the surest mask on top": {"on_top": "surest"},
    "classes clustered apart": {"by_class": True},
    "overlap over all triangles": {"overlap": "all"},
    "all views vote": {"voters": "all"},
    "modularity": {"objective": "modularity"},
    "modularity, resolution 10": {"objective": "modularity", "resolution": 10.0},
    "without soft borders": {"border_band": 0.0},
    "one sample a triangle": {"max_splits": 1},
    "no support needed": {"min_support": 0.0},
    "duplicates stay": {"drop_duplicates": False},
    "no reassignment": {"rounds": 0},
    "pinholes stay": {"fill_pinholes": False},
    "all of these taken back": {
        "on_top": "surest",
        "by_class": True,
        "overlap": "all",
        "voters": "all",
        "objective": "modularity",
        "border_band": 0.0,
        "max_splits": 1,
        "min_support": 0.0,
        "drop_duplicates": False,
        "rounds": 0,
        "fill_pinholes": False,
    },
    "literal": {"method": "literal"},
    "literal, the surest mask on top": {"method": "literal", "on_top": "surest"},
    "literal, resolution 10": {"method": "literal", "resolution": 10.0},
    "literal, resolution 10, surest on top": {
        "method": "literal",
        "resolution": 10.0,
        "on_top": "surest",
    },
}
GIVEN: dict[str, dict[str, Any]] = {
    "robust": {},
    "robust, surest on top": {"on_top": "surest"},
    **{
        f"literal, resolution {resolution:g}{words}": {
            "method": "literal",
            "resolution": resolution,
            "on_top": on_top,
        }
        for on_top, words in (("small", ""), ("surest", ", surest on top"))
        for resolution in (1.0, 3.0, 10.0)
    },
    "literal, resolution 1, ranked by share": {"method": "literal", "confidence": "share"},
}


def load_gym(data: Path, masks: str) -> tuple[Mesh, list[View], Mapping[str, NDArray[Any]]]:
    """Return mesh, views with masks, and the truth's arrays of gym-a/lift."""
    folder = data / "gym-a" / "lift"
    truth = np.load(folder / "gt.npz")
    mesh = Mesh(truth["vertices"].astype(np.float64), truth["faces"].astype(np.int32))
    found, _ = read_coco_masks(folder / f"{masks}.json")
    views = [v.with_masks(found.get(v.name, ())) for v in read_views(folder / "cameras")]
    return mesh, views, {name: truth[name] for name in ("face_instance", "face_views")}


def _true(truth: NDArray[np.int32]) -> Labelled:
    return Labelled(truth.astype(np.int32), {int(k): 1 for k in np.unique(truth) if k > 0})


def _overlap(
    found: Instances, mesh: Mesh, truth: NDArray[np.int32], face_views: NDArray[np.int32]
) -> Overlap:
    return overlap_of_faces(Labelled.of(found), _true(truth), mesh.areas, face_views == 0)


def against(
    found: Instances, mesh: Mesh, truth: NDArray[np.int32], face_views: NDArray[np.int32]
) -> ApSummary:
    """Return the AP by face area, classes merged into one; faces that no view sees are ignored."""
    return summarise_instances([_overlap(found, mesh, truth, face_views)]).agnostic


def _sets(
    mesh: Mesh, views: Sequence[View], params: LiftParams, truth: Mapping[str, NDArray[Any]]
) -> Overlap:
    """Return the overlap of Algorithm 7's instances with the truth."""
    from scipy import sparse

    evidence, cluster, kept = literal_kept(mesh, views, params)
    weights = np.where(truth["face_views"] > 0, mesh.areas, 0.0)
    face = evidence.faces[kept.face]
    seen = weights[face] > 0
    alive, row = np.unique(kept.cluster[seen], return_inverse=True)
    column = np.unique(truth["face_instance"], return_inverse=True)[1]
    wanted = np.flatnonzero((truth["face_instance"] > 0) & (weights > 0))
    ids = np.unique(column[wanted])
    found = sparse.csr_matrix(
        (np.ones(len(row)), (row, face[seen])), shape=(len(alive), len(weights))
    )
    objects = sparse.csr_matrix(
        (np.ones(len(wanted)), (np.searchsorted(ids, column[wanted]), wanted)),
        shape=(len(ids), len(weights)),
    )
    scores = np.bincount(cluster, projection_scores(evidence))[alive]
    ones = np.ones(len(alive), dtype=np.int64), np.ones(len(ids), dtype=np.int64)
    return overlap_of_sets(found, objects, weights, np.asarray(scores, np.float64), *ones)


def _row(name: str, overlap: Overlap) -> str:
    a = summarise_instances([overlap]).agnostic
    exact = exact_ap([overlap], (*SCANNET_THRESHOLDS, 0.95, 0.25))
    cells = (
        name,
        f"{a.ap:.3f} / {a.ap50:.3f} / {a.ap25:.3f}",
        f"{a.coco_ap:.3f} / {a.coco_ap50:.3f}",
        f"{exact[:9].mean():.3f} / {exact[0]:.3f} / {exact[-1]:.3f}",
        f"{exact[:10].mean():.3f}",
        f"{a.predicted} of {a.truth}",
    )
    return "| " + " | ".join(cells) + " |"


def given(data: Path) -> None:
    """Print the figures on the masks of gym-a; no setting was chosen on them."""
    print(
        "| masks, method | ScanNet: AP / AP50 / AP25 | COCO: AP / AP50 "
        "| every recall: AP / AP50 / AP25 | AP .50:.95 | instances |\n|---|---|---|---|---|---|"
    )
    for masks in ("noisy", "clean"):
        mesh, views, truth = load_gym(data, masks)
        for name, change in GIVEN.items():
            params = replace(LiftParams(), **change)
            found = lift(mesh, views, params)
            overlap = _overlap(found, mesh, truth["face_instance"], truth["face_views"])
            print(_row(f"{masks}, {name}", overlap), flush=True)
            if params.method == "literal" and params.confidence == "mean":
                overlap = _sets(mesh, views, params, truth)
                print(_row(f"{masks}, {name}, as sets", overlap), flush=True)


def _spoilt(scenes: int) -> list[tuple[str, Scene, Sequence[View]]]:
    """Return scenes 100 and up, with clean masks and two kinds of noise."""
    noises = {"noisy": MaskNoise(), "hard": MaskNoise(halved=0.06, twice=0.06)}
    cases: list[tuple[str, Scene, Sequence[View]]] = []
    for seed in range(scenes):
        scene = make_scene(100 + seed)
        for name, noise in noises.items():
            cases.append((name, scene, spoil(scene.views, noise, seed + 50 * (name == "hard"))))
        cases.append(("clean", scene, scene.views))
    return cases


def ablation(scenes: int) -> None:
    """Print ScanNet's APs, means over the scenes."""
    cases = _spoilt(scenes)
    print(
        "| variant | clean AP | noisy AP / AP50 / AP25 | hard AP / AP50 / AP25 |\n|---|---|---|---|"
    )
    for label, change in ABLATION.items():
        rows: dict[str, list[list[float]]] = {}
        for name, scene, views in cases:
            found = lift(scene.mesh, views, replace(LiftParams(), **change))
            a = against(found, scene.mesh, scene.face_instance, scene.face_views)
            rows.setdefault(name, []).append([a.ap, a.ap50, a.ap25])
        mean = {name: np.mean(values, axis=0) for name, values in rows.items()}
        texts = [" / ".join(f"{v:.3f}" for v in mean[name]) for name in ("noisy", "hard")]
        print(f"| {label} | {mean['clean'][0]:.3f} | {texts[0]} | {texts[1]} |", flush=True)


def gyms(work: Path) -> None:
    """Print ScanNet's APs on generated gyms, with masks by the shipped detector."""
    plan = Plan(work, gyms=0, photos=32, trials=0)
    walls = {preset: [load_wall(plan, preset, 0)] for preset in plan.presets}
    names = " | ".join(f"{preset}: AP, merged | AP50 | AP, mean of classes" for preset in walls)
    print(f"| variant | {names} |\n|---" + "|---" * (3 * len(walls)) + "|")
    for label, change in ABLATION.items():
        method, settings = change.get("method", "robust"), dict(change)
        settings.pop("method", None)
        cells = []
        for wall in walls.values():
            row = lift_rows(wall, {label: (method, settings)})[label]
            merged, mean = row["agnostic"], row["mean"]
            cells += [f"{v:.3f}" for v in (merged["ap"], merged["ap50"], mean["ap"])]
        print(f"| {label} | " + " | ".join(cells) + " |", flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("what", choices=("given", "ablation", "gyms"))
    parser.add_argument("data", type=Path, nargs="?", help="folder that holds gym-a; or WORK")
    parser.add_argument("--scenes", type=int, default=3, help="ablation: number of scenes")
    args = parser.parse_args(arguments)
    if args.what == "ablation":
        ablation(args.scenes)
    elif args.data is None:
        parser.error(f"{args.what} needs a folder")
    elif args.what == "given":
        given(args.data)
    else:
        gyms(args.data)


if __name__ == "__main__":
    main()
