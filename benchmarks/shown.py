"""The two limits that decide which lifted instances a scan shows as holds.

    python -m benchmarks.shown score [--work FOLDER] [--gyms 2] [--preset modern]
    python -m benchmarks.shown flat SCAN TRUTH [SCAN TRUTH ...]

`score` evaluates `classify.min_score`. It generates the gyms that `benchmarks.lift_tuned` tunes
and chooses on (its test gyms stay unused), detects their holds with
the shipped detector, and lifts with a scan's settings. It prints for several minimum scores: mIoU
over all gyms, precision, recall and F1 of the shown holds, and the volumes shown and right.

`flat` evaluates `classify.flat_below`. Each SCAN is a finished scan of a gym whose exact truth is
the folder TRUTH (`walltopo synth` writes one as GYM/truth). It prints for several limits how many
real holds, and how many false instances (less than 1 % on a true instance), are called flat.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.lift_tuned import Plan, load_wall, scan_defaults
from walltopo.core import Silent
from walltopo.describe.classify.low_confidence import Lifted, Rise, flat_instances, measure_rises
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.segment.lift import LiftParams, lift
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.mesh import REACH_M
from walltopo_lab.evaluate.operating import at_score, operating_point
from walltopo_lab.evaluate.overlap import Labelled
from walltopo_lab.evaluate.routes import match_pairs
from walltopo_lab.evaluate.scan import measured_labels, scan_views
from walltopo_lab.evaluate.semantics import class_of_faces, confusion, semantic_metrics
from walltopo_lab.evaluate.truth import read_truth

MIN = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
LIMITS = (0.002, 0.003, 0.004, 0.005, 0.006, 0.008, 0.010)  # metres
HOLD, VOLUME = 1, 2
WITHIN = 0.02
NOTHING = 0.01  # share of an instance's area on true instances below which it is false


def score(args: argparse.Namespace) -> None:
    """Print the figures of each minimum score."""
    plan = Plan(args.work, 0, args.photos, 0)
    walls = [load_wall(plan, args.preset, number) for number in range(args.gyms)]
    params = LiftParams(**scan_defaults())
    found = [Labelled.of(lift(wall.mesh, wall.views, params, Silent())) for wall in walls]
    print("| least score | mIoU | holds: precision | recall | F1 | volumes shown | right | of |")
    print("|---|---|---|---|---|---|---|---|")
    for least in MIN:
        shown = [at_score(labelled, least) for labelled in found]
        tables = [
            confusion(
                class_of_faces(labelled),
                class_of_faces(wall.carried.labelled),
                wall.mesh.areas * ~wall.carried.ignored,
                3,
            )
            for wall, labelled in zip(walls, shown, strict=True)
        ]
        overlaps = [wall.overlap(labelled) for wall, labelled in zip(walls, shown, strict=True)]
        holds = operating_point([overlap.select(HOLD) for overlap in overlaps])
        volumes = operating_point([overlap.select(VOLUME) for overlap in overlaps])
        print(
            f"| {least} | {semantic_metrics(tables).miou:.3f} | {holds.precision:.3f} | "
            f"{holds.recall:.3f} | {holds.as_dict()['f1']:.3f} | {volumes.shown} | "
            f"{volumes.hits} | {volumes.truth} |"
        )


def heights(folder: Path, truth_folder: Path) -> tuple[dict[int, Rise], dict[int, Rise]]:
    """Return heights of the scan's real holds and of its false ones, without half matches."""
    scan, truth = ScanFolder(folder), read_truth(truth_folder)
    whole = read_mesh(scan.mesh)
    mesh = whole.without_guesses()
    found = measured_labels(scan, whole)
    table = InstanceTable(found.face_instance, np.zeros(len(mesh.faces), dtype=np.float32))
    lifted = Lifted.of(table, InstanceRecords.load(scan.instance_records))
    rises = measure_rises(mesh, lifted.face_instance, lifted.kinds, 1.0)
    turned = align_views(scan_views(scan, truth), truth.views, False).mesh(mesh)
    carried = carry_truth(truth, turned, WITHIN, REACH_M)
    pairs = match_pairs(overlap_with_missing(found, carried, mesh.areas, truth))
    size = max(rises, default=0) + 1
    labels = np.where(lifted.face_instance < size, lifted.face_instance, 0)
    on_truth = np.where(carried.labelled.face_instance > 0, mesh.areas, 0.0)
    areas = np.bincount(labels, mesh.areas, size)
    share = np.bincount(labels, on_truth, size) / np.maximum(areas, 1e-12)
    real = {number: rise for number, rise in rises.items() if number in pairs}
    none = {number: rise for number, rise in rises.items() if share[number] < NOTHING}
    return real, none


def flat(args: argparse.Namespace) -> None:
    """Print the instances that each limit calls flat."""
    folders = zip(args.folders[::2], args.folders[1::2], strict=True)
    found = [heights(scan, truth) for scan, truth in folders]
    print("| flat below, mm | real ones called flat | false ones called flat |")
    print("|---|---|---|")
    for limit in LIMITS:
        called = [[len(flat_instances(rows, 1.0, limit)) for rows in pair] for pair in found]
        real, none = (sum(len(pair[k]) for pair in found) for k in (0, 1))
        lost, caught = (sum(pair[k] for pair in called) for k in (0, 1))
        print(f"| {limit * 1000:.0f} | {lost} of {real} | {caught} of {none} |")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    words = parser.add_subparsers(required=True)
    one = words.add_parser("score")
    one.add_argument("--work", type=Path, default=Path("tables"))
    one.add_argument("--preset", default="modern")
    one.add_argument("--gyms", type=int, choices=(1, 2), default=2)
    one.add_argument("--photos", type=int, default=32)
    one.set_defaults(run=score)
    two = words.add_parser("flat")
    two.add_argument("folders", type=Path, nargs="+", metavar="SCAN TRUTH")
    two.set_defaults(run=flat)
    args = parser.parse_args()
    args.run(args)


if __name__ == "__main__":
    main()
