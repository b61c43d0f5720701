"""Which instances of a scan are real, by their score: how `classify.least_score` was chosen.

    walltopo synth gym --preset modern --seed 3 --photos 24 --size 1280x960
    walltopo scan gym/photos -o scan --to lift
    python -m benchmarks.least_score scan gym/truth

prints, for several least scores, how many instances are left, how many of them meet a true one
at IoU 0.5, and precision, recall and F1. Run it on gyms that nothing is reported on.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from walltopo.evaluate.align import align_views
from walltopo.evaluate.carry import carry_truth, overlap_with_missing
from walltopo.evaluate.scan import read_labelled, scan_views
from walltopo.evaluate.truth import read_truth
from walltopo.formats.ply import read_mesh
from walltopo.workspace import ScanFolder

LEAST = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)
WITHIN_M = 0.02


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", type=Path)
    parser.add_argument("truth", type=Path)
    args = parser.parse_args()
    scan, truth = ScanFolder(args.scan), read_truth(args.truth)
    transform = align_views(scan_views(scan, truth), truth.views, False)
    mesh = transform.mesh(read_mesh(scan.mesh))
    predicted = read_labelled(scan.instances, scan.instance_records)
    carried = carry_truth(truth, mesh, WITHIN_M)
    overlap = overlap_with_missing(predicted, carried, mesh.areas, truth)
    best = overlap.iou().max(axis=1, initial=0.0)
    print("| least score | instances | true | precision | recall | F1 |\n|---|---|---|---|---|---|")
    for least in LEAST:
        left = overlap.pred_scores >= least
        hits, count, real = int((best[left] >= 0.5).sum()), int(left.sum()), len(overlap.truth_ids)
        print(
            f"| {least} | {count} | {hits} | {hits / max(count, 1):.3f} | {hits / real:.3f} | "
            f"{2 * hits / (count + real):.3f} |"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
