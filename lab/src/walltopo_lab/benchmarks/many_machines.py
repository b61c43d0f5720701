"""How long the scans of 10,000 gyms wait for machines, by simulation.

    python -m walltopo_lab.benchmarks.many_machines simulate SCAN     from the seconds in its scan.json

Each of 10,000 gyms resets once a week and scans a wall such as SCAN, a task of two
cores that takes what its stages took; list scheduling, first come first served. Scans come at times
drawn evenly from the week; from the evenings of its first four days (18 to 24 h, all gyms in one
time zone); or all at one moment. Every week begins with nothing left over. No machine is lost,
folders cost nothing, and a core is as fast as that of SCAN.
"""

from __future__ import annotations

import heapq
import sys
from collections.abc import Iterator, Sequence

import numpy as np

from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest

GYMS = 10_000
CORES_A_SCAN = 2
WEEK_H = 168.0
CORES = (4, 6, 10, 20, 40, 100, 1_000, 10_000, 20_000, 40_000)
SEED = 0


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
    if sys.argv[1:2] == ["simulate"] and len(sys.argv) == 3:
        print(*simulate(ScanFolder(sys.argv[2])), sep="\n")
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
