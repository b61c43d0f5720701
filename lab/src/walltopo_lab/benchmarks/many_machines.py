"""What Ray costs and gives on this machine, and what many machines would, by simulation.

    python -m walltopo_lab.benchmarks.many_machines measure SCAN      detection by 1 and 2 workers
    python -m walltopo_lab.benchmarks.many_machines simulate SCAN     from the seconds in its scan.json

Measured: the photos of a finished scan, each a task, by a cluster of one and of two cores, in turn,
and tasks that do nothing.

Simulated: each of 10,000 gyms resets once a week and scans a wall such as SCAN, a task of two
cores that takes what its stages took; list scheduling, first come first served. Scans come at times
drawn evenly from the week; from the evenings of its first four days (18 to 24 h, all gyms in one
time zone); or all at one moment. Every week begins with nothing left over. No machine is lost,
folders cost nothing, and a core is as fast as that of SCAN.
"""

from __future__ import annotations

import heapq
import os
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from walltopo.images.files import read_rgb
from walltopo.pipeline.ray_workers import RayWorkers, on_cluster
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest
from walltopo.segment.detect.detector import Detector, open_detector
from walltopo.segment.detect.settings import DetectSettings

GYMS = 10_000
CORES_A_SCAN = 2
WEEK_H = 168.0
CORES = (4, 6, 10, 20, 40, 100, 1_000, 10_000, 20_000, 40_000)
ROUNDS = 3
EMPTY = 400
SEED = 0


def measure(scan: ScanFolder, scratch: Path) -> Iterator[str]:
    """A line for each figure; ratios are of rounds that were run in turn."""
    photos = sorted(scan.photos.iterdir())
    took: dict[int, list[float]] = {1: [], 2: []}
    empty = []
    for _ in range(ROUNDS):
        for cores, seconds in took.items():
            with on_cluster("local", cores):
                workers = RayWorkers().within(scratch)
                _seconds(workers, photos)  # starts the processes, reads the libraries
                seconds.append(_seconds(workers, photos))
                if cores == 1:
                    empty.append(_empty(workers))
    ratio = statistics.median(a / b for a, b in zip(took[1], took[2], strict=True))
    yield f"load of the machine at the end: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    yield f"detection in {len(photos)} photos, 1 worker against 2: {ratio:.2f} times the time"
    yield f"a task that does nothing: {1000 * statistics.median(empty):.1f} ms"


def _seconds(workers: RayWorkers, photos: Sequence[Path]) -> float:
    opened = partial(open_detector, DetectSettings(size=640, again=0, threads=1))
    begun = time.perf_counter()
    for _ in workers.map(opened, _count, photos):
        pass
    return time.perf_counter() - begun


def _count(detector: Detector, photo: Path) -> int:
    return len(detector.detect(read_rgb(photo)))


def _empty(workers: RayWorkers) -> float:
    """Seconds of a task that does nothing, one after the other through one worker."""
    begun = time.perf_counter()
    for _ in workers.map(int, max, range(EMPTY)):
        pass
    return (time.perf_counter() - begun) / EMPTY


def waits(arrivals: Sequence[float], seconds: float, places: int) -> list[float]:
    """Seconds that each task waits, first come first served.

    Parameters
    ----------
    arrivals : sorted, seconds. seconds : of a task. places : how many run at a time.
    """
    free = [0.0] * places
    found = []
    for arrival in arrivals:
        begun = max(arrival, heapq.heappop(free))
        found.append(begun - arrival)
        heapq.heappush(free, begun + seconds)
    return found


def simulate(scan: ScanFolder) -> Iterator[str]:
    """The table over numbers of cores."""
    stages = Manifest.load(scan.manifest).stages
    seconds = sum(record.seconds for record in stages.values() if record.state == "done")
    cost = GYMS * CORES_A_SCAN * seconds / 3600
    yield f"one scan: {seconds:.0f} s on {CORES_A_SCAN} cores"
    yield f"{GYMS:,} scans a week: {cost:,.0f} core-hours, {cost / WEEK_H:.1f} cores that never rest"
    yield ""
    yield "| cores | busy | wait of 19 in 20, even | wait of 19 in 20, evenings | all at once, last |"
    yield "|---|---|---|---|---|"
    even, evenings = arrivals()
    for cores in CORES:
        places = cores // CORES_A_SCAN
        late = [np.quantile(waits(come, seconds, places), 0.95) / 60 for come in (even, evenings)]
        last = (max(waits([0.0] * GYMS, seconds, places)) + seconds) / 60
        busy = min(1.0, cost / (cores * WEEK_H))
        told = " | ".join(f"{value:,.0f} min" for value in (*late, last))
        yield f"| {cores:,} | {busy:.1%} | {told} |"


def arrivals() -> tuple[list[float], list[float]]:
    """Seconds after the week's beginning at which scans come: evenly, and in evenings; sorted."""
    draw = np.random.default_rng(SEED)
    even = draw.uniform(0, WEEK_H * 3600, GYMS)
    days, hours = draw.integers(0, 4, GYMS), draw.uniform(18, 24, GYMS)
    return np.sort(even).tolist(), np.sort((24 * days + hours) * 3600).tolist()


def main() -> None:
    if sys.argv[1:2] == ["measure"] and len(sys.argv) == 3:
        import tempfile

        with tempfile.TemporaryDirectory() as scratch:
            print(*measure(ScanFolder(sys.argv[2]), Path(scratch)), sep="\n")
    elif sys.argv[1:2] == ["simulate"] and len(sys.argv) == 3:
        print(*simulate(ScanFolder(sys.argv[2])), sep="\n")
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
