"""CPU-seconds of each stage of a scan, now and at an earlier commit, in turns.

    python -m benchmarks.stage_times PHOTOS --before COMMIT
    python -m benchmarks.stage_times PHOTOS --before COMMIT --only sparse dense

Both run the command `walltopo scan` for one stage at a time, on a folder of their own, with this
environment's packages; the earlier commit's sources come from a git worktree. Start-up counts, and
the times of all threads; compiling kernels does not. Stages run in turns, so that a busy machine
slows both alike. The earlier commit must have the commands that this environment installs.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from walltopo.pipeline.plan import names_of_plan

ROOT = Path(__file__).resolve().parent.parent
VIEWER = Path("src/walltopo/publish/page/viewer.js")
STAGES = names_of_plan(part=False)
_COMPILE = """
from walltopo.pipeline.warm_up import TABLE, compile_line
for line in TABLE.read_text().splitlines():
    compile_line(line)
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("photos", type=Path, metavar="PHOTOS")
    parser.add_argument("--before", required=True, metavar="COMMIT")
    parser.add_argument("--only", nargs="+", choices=STAGES, default=STAGES)
    parser.add_argument("--keep", type=Path, help="keep both scans in this folder, and go on there")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        earlier = Path(temporary) / "earlier"
        subprocess.run(["git", "worktree", "add", "-q", earlier, args.before], cwd=ROOT, check=True)
        try:
            shutil.copyfile(ROOT / VIEWER, earlier / VIEWER)  # built, not committed
            for tree in (earlier, ROOT):
                run_in(tree, "-c", _COMPILE)  # no stage pays for compiling kernels
            compare(args.photos, args.keep or Path(temporary), earlier, args.only)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", earlier], cwd=ROOT, check=True)
    return 0


def compare(photos: Path, folder: Path, earlier: Path, only: Sequence[str]) -> None:
    """Print a table: stage, CPU-seconds of the earlier commit and of this tree, their ratio."""
    print("| stage | before | now | ratio |\n|---|---|---|---|")
    totals = [0.0, 0.0]
    for stage in STAGES:
        seconds = [
            stage_cpu_s(tree, photos, folder / name, stage)
            for name, tree in (("before", earlier), ("now", ROOT))
        ]
        if stage in only:
            totals = [total + spent for total, spent in zip(totals, seconds, strict=True)]
            print_row(stage, seconds)
    print_row("all", totals)


def print_row(stage: str, seconds: list[float]) -> None:
    before, now = seconds
    print(f"| {stage} | {before:.1f} | {now:.1f} | {now / before:.2f} |", flush=True)


def stage_cpu_s(tree: Path, photos: Path, scan: Path, stage: str) -> float:
    """Run one stage with the sources in `tree`; return the child's CPU-seconds."""
    start = resource.getrusage(resource.RUSAGE_CHILDREN)
    run_in(tree, "-m", "walltopo", "scan", photos, "-o", scan, "--to", stage, "--quiet")
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (end.ru_utime + end.ru_stime) - (start.ru_utime + start.ru_stime)


def run_in(tree: Path, *arguments: str | Path) -> None:
    """Run Python with the sources in `tree`; raise CalledProcessError if it fails."""
    paths = os.pathsep.join(map(str, [tree / "src", *tree.glob("*/src")]))
    subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.DEVNULL,
        cwd=ROOT,
        check=True,
    )


if __name__ == "__main__":
    sys.exit(main())
