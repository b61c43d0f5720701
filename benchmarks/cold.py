"""Extra time of the first scan on a machine over the second: the compilation of kernels.

    python -m benchmarks.cold examples/demo-photos
    python -m benchmarks.cold examples/demo-photos --installed
    python -m benchmarks.cold examples/demo-photos --record

Two scans of the same photos run, the first with an empty numba cache. The output is the seconds per
stage of both, and the time that the scan itself compiled (the part outside `pipeline.warm_up`).
`--installed` leaves numba's files in place: just after an installation of the wheel that contains
them, the first scan is that of a new user. `--record` writes the table of kernels that the warm-up
uses.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.calibration import calibration_s
from walltopo.core.files import read_json
from walltopo.pipeline.warm_up import TABLE

_KERNEL_FLOOR = "walltopo."


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("photos", type=Path)
    parser.add_argument("--record", action="store_true", help="write the warm-up's table")
    parser.add_argument("--installed", action="store_true", help="as the package was installed")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary)
        if args.record:
            TABLE.write_text("", encoding="utf-8")  # so that the scan compiles all itself
        cold = _scan(args.photos, root, "cold", args.installed)
        if args.record:
            TABLE.write_text("".join(f"{line}\n" for line in cold["kernels"]), encoding="utf-8")
            print(f"{len(cold['kernels'])} kernels in {TABLE}")
            return 0
        warm = _scan(args.photos, root, "warm", args.installed)
    print("| stage | first s | second s | more s |\n|---|---|---|---|")
    for stage, seconds in warm["stages"].items():
        first = cold["stages"][stage]
        print(f"| {stage} | {first:.1f} | {seconds:.1f} | {first - seconds:.1f} |")
    first, second = sum(cold["stages"].values()), sum(warm["stages"].values())
    print(f"| all | {first:.1f} | {second:.1f} | {first - second:.1f} |")
    unit = calibration_s()
    print(f"\ncalibration {unit:.3f} s: the second scan took {second / unit:.0f} of them")
    known = set(TABLE.read_text(encoding="utf-8").splitlines())
    print(
        f"\ncompiled by the scan itself: {len(cold['kernels'])} kernels, {cold['compiling']:.1f} s"
    )
    print(f"not in the table: {[line for line in cold['kernels'] if line not in known]}")
    return 0


def _scan(photos: Path, root: Path, name: str, installed: bool) -> dict[str, Any]:
    """Scan in a child process; return seconds per stage and the compiled kernels.

    Numba's cache lies in `root`, or stays in its own place with `installed`.
    """
    file = root / f"{name}.json"
    own = {} if installed else {"NUMBA_CACHE_DIR": str(root / "kernels")}
    environment = {**os.environ, **own}
    command = [sys.executable, "-m", __spec__.name if __spec__ else __name__, "--watched"]
    subprocess.run([*command, photos, root / name, file], check=True, env=environment)
    stages = read_json(root / name / "scan.json")["stages"]
    return {"stages": {key: stages[key]["seconds"] for key in stages}, **read_json(file)}


def _watched(photos: str, out: str, file: str) -> None:
    """Run a scan and write the kernels that it compiled, and the time of compiling, to `file`."""
    from numba.core import event

    from walltopo.cli import main as walltopo

    kernels: list[str] = []

    class _Listener(event.Listener):
        depth, seconds = 0, 0.0

        def on_start(self, event: Any) -> None:
            if self.depth == 0:
                self.since = time.perf_counter()
            self.depth += 1

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            function = event.data["dispatcher"].py_func
            if self.depth == 0:
                self.seconds += time.perf_counter() - self.since
                if function.__module__.startswith(_KERNEL_FLOOR):
                    types = ", ".join(map(str, event.data["args"]))
                    kernels.append(f"{function.__module__} {function.__name__} ({types},)")

    listener = _Listener()
    event.register("numba:compile", listener)
    sys.argv = ["walltopo", "scan", photos, "-o", out, "-q"]
    code = walltopo()
    Path(file).write_text(json.dumps({"kernels": kernels, "compiling": listener.seconds}))
    raise SystemExit(code)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--watched"]:
        _watched(*sys.argv[2:])
    raise SystemExit(main())
