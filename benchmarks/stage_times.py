"""CPU-seconds of each stage of a scan, now and at an earlier commit, in turns.

    python -m benchmarks.stage_times PHOTOS --before COMMIT
    python -m benchmarks.stage_times PHOTOS --before COMMIT --only sparse dense

Both run the command `walltopo scan` for one stage at a time, on a folder of their own, with this
environment's packages; the earlier commit's files are unpacked into a temporary folder. Start-up
and all threads count; compiling kernels does not. Stages run in turns, so that a busy machine slows
both alike. The earlier commit must have the commands that this environment installs.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tools.compiled_wheel import COMPILE_KERNELS
from tools.upgrade_check import Walltopo, unpack

from benchmarks.reconstruction_poses import cpu_seconds
from walltopo.pipeline.plan import names_of_plan

ROOT = Path(__file__).resolve().parent.parent
VIEWER = Path("src/walltopo/publish/page/viewer.js")
STAGES = names_of_plan(part=False)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("photos", type=Path, metavar="PHOTOS")
    parser.add_argument("--before", required=True, metavar="COMMIT")
    parser.add_argument("--only", nargs="+", choices=STAGES, default=STAGES)
    parser.add_argument("--keep", type=Path, help="keep both scans in this folder, and go on there")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        tree = Path(temporary) / "earlier"
        earlier, now = unpack(args.before, tree), Walltopo(ROOT)
        shutil.copyfile(ROOT / VIEWER, tree / VIEWER)  # built, not committed
        for walltopo in (earlier, now):
            walltopo.run_python("-c", COMPILE_KERNELS)  # no stage pays for it
        compare(args.photos, args.keep or Path(temporary), earlier, now, args.only)
    return 0


def compare(
    photos: Path, folder: Path, earlier: Walltopo, now: Walltopo, only: Sequence[str]
) -> None:
    """Print a table: stage, CPU-seconds of the earlier commit and of this tree, their ratio."""
    print("| stage | before | now | ratio |\n|---|---|---|---|")
    totals = [0.0, 0.0]
    last = max(map(STAGES.index, only))
    for stage in STAGES[: last + 1]:
        seconds = [
            stage_cpu_s(walltopo, photos, folder / name, stage)
            for name, walltopo in (("before", earlier), ("now", now))
        ]
        if stage in only:
            totals = [total + spent for total, spent in zip(totals, seconds, strict=True)]
            print_row(stage, seconds)
    print_row("all", totals)


def print_row(stage: str, seconds: list[float]) -> None:
    before, now = seconds
    print(f"| {stage} | {before:.1f} | {now:.1f} | {now / before:.2f} |", flush=True)


def stage_cpu_s(walltopo: Walltopo, photos: Path, scan: Path, stage: str) -> float:
    """Run one stage in a child process; return its CPU-seconds."""
    before = cpu_seconds()
    walltopo.run("scan", photos, "-o", scan, "--to", stage, "--quiet")
    return cpu_seconds() - before


if __name__ == "__main__":
    sys.exit(main())
