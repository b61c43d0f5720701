"""Which instances of a scan are real, by their score: how `classify.least_score` was chosen.

    python -m walltopo_lab.benchmarks.least_score [--work FOLDER] [--gyms 2] [--preset modern]

generates the gyms that the lift's table tunes and chooses on (`walltopo_lab.benchmarks.tables`; those that it
reports on are left alone), finds their holds with the shipped detector, lifts with a scan's
settings and prints, for several least scores: mIoU over all gyms, precision, recall and F1 of the
holds that are shown, and the volumes shown and right.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.core import Silent
from walltopo.lifting import LiftParams, lift
from walltopo_lab.benchmarks.tables_lift import Plan, load_wall, scan_defaults
from walltopo_lab.evaluate.operating import at_score, operating_point
from walltopo_lab.evaluate.overlap import Labelled
from walltopo_lab.evaluate.semantics import class_of_faces, confusion, semantic_metrics

LEAST = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
HOLD, VOLUME = 1, 2


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--work", type=Path, default=Path("tables"))
    parser.add_argument("--preset", default="modern")
    parser.add_argument("--gyms", type=int, choices=(1, 2), default=2)
    parser.add_argument("--photos", type=int, default=32)
    args = parser.parse_args()
    plan = Plan(args.work, 0, args.photos, 0)
    walls = [load_wall(plan, args.preset, number) for number in range(args.gyms)]
    params = LiftParams(**scan_defaults())
    found = [Labelled.of(lift(wall.mesh, wall.views, params, Silent())) for wall in walls]
    print("| least score | mIoU | holds: precision | recall | F1 | volumes shown | right | of |")
    print("|---|---|---|---|---|---|---|---|")
    for least in LEAST:
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


if __name__ == "__main__":
    main()
