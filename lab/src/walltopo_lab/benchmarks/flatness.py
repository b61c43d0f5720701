"""How far holds and false holds stand out of the wall: how `classify.flat_below` was chosen.

    python -m walltopo_lab.benchmarks.flatness SCAN TRUTH [SCAN TRUTH ...]

Each SCAN is a finished scan of a gym whose exact truth is the folder TRUTH (`walltopo synth`
writes one as GYM/truth). Everything that the lift found counts, doubtful or not. Printed: the
lowest heights of real holds, the heights of what is none (less than 1 % of it lies on a true
instance), and for several limits how many of either are called flat.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from walltopo.holds.doubtful import read_instances
from walltopo.holds.flatness import Rise, flat_instances, measure_rises
from walltopo.meshes.ply import read_mesh
from walltopo.scans.folder import ScanFolder
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.mesh import REACH_M
from walltopo_lab.evaluate.routes import match_pairs
from walltopo_lab.evaluate.scan import read_labelled, scan_views
from walltopo_lab.evaluate.truth import read_truth

LIMITS = (0.002, 0.003, 0.004, 0.005, 0.006, 0.008, 0.010)
WITHIN = 0.02
NOTHING = 0.01  # share of an instance on true instances below which it is none


def heights(folder: Path, truth_folder: Path) -> tuple[dict[int, Rise], dict[int, Rise]]:
    """Rises of the real holds of a scan and of what is none; half matches are left out."""
    scan, truth = ScanFolder(folder), read_truth(truth_folder)
    mesh = read_mesh(scan.mesh)
    lifted = read_instances(scan, len(mesh.faces))
    rises = measure_rises(mesh, lifted.face_instance, lifted.kinds, 1.0)
    turned = align_views(scan_views(scan, truth), truth.views, False).mesh(mesh)
    carried = carry_truth(truth, turned, WITHIN, REACH_M)
    found = read_labelled(scan.instances, scan.instance_records)
    pairs = match_pairs(overlap_with_missing(found, carried, mesh.areas, truth))
    on_truth = np.where(carried.labelled.face_instance > 0, mesh.areas, 0.0)
    size = max(rises, default=0) + 1
    labels = np.where(lifted.face_instance < size, lifted.face_instance, 0)
    share = np.bincount(labels, on_truth, size) / np.maximum(
        np.bincount(labels, mesh.areas, size), 1e-12
    )
    real = {number: rise for number, rise in rises.items() if number in pairs}
    none = {number: rise for number, rise in rises.items() if share[number] < NOTHING}
    print(f"{folder.name}: {len(real)} real, {len(none)} none")
    for title, rows in (("real", real), ("none", none)):
        told = sorted((rise.height * 1000, rise.noise * 1000) for rise in rows.values())[:20]
        print(
            f"  lowest {title}, mm (roughness): " + ", ".join(f"{h:.1f} ({n:.1f})" for h, n in told)
        )
    return real, none


def main() -> None:
    words = sys.argv[1:]
    if not words or len(words) % 2:
        raise SystemExit(__doc__)
    found = [heights(Path(a), Path(b)) for a, b in zip(words[::2], words[1::2], strict=True)]
    print("| flat below, mm | real ones called flat | false ones called flat |")
    print("|---|---|---|")
    for limit in LIMITS:
        flat = [[len(flat_instances(rows, 1.0, limit)) for rows in pair] for pair in found]
        real, none = (sum(len(pair[k]) for pair in found) for k in (0, 1))
        lost, caught = (sum(pair[k] for pair in flat) for k in (0, 1))
        print(f"| {limit * 1000:.0f} | {lost} of {real} | {caught} of {none} |")


if __name__ == "__main__":
    main()
