"""Interrupt a scan again and again, at random moments by random signals: it ends with the same bytes.

    python -m benchmarks.interruptions [--photos DIR] [--count 100] [--seed 0]

One scan runs undisturbed. Another is interrupted by SIGKILL, SIGINT or SIGTERM and restarted until
it ends. Then its files are compared with the first one's and it begins anew, until `--count`
interruptions are made. Prints the interrupted stages and the delays of the stops; exits 1 if a file
differs or is half-written, or a stop was reported wrongly.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from walltopo.core.files import files_below
from walltopo.scans.manifest import Manifest
from walltopo_lab.synth import write_tiny_gym

# Use small pictures, because large ones would take most of the time.
SIZES = ("texture.size", "export.first_texture", "export.detail_texture", "export.archive_texture")
SETTINGS = tuple(word for size in SIZES for word in ("--set", f"{size}=512"))
SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
# Files with times, and caches; all other files must be equal.
APART = ("scan.json", "report.html", "work/features", "work/mapping", "work/hashes.json")


@dataclass
class Tally:
    """The counts and failures of a run.

    Parameters
    ----------
    stages : number of signals by stage.
    delays : seconds from signal to exit, by signal.
    wrong : failed checks, in words.
    compared : number of compared finished scans.
    """

    stages: Counter[str] = field(default_factory=Counter)
    delays: dict[int, list[float]] = field(default_factory=lambda: {s: [] for s in SIGNALS})
    wrong: list[str] = field(default_factory=list)
    compared: int = 0

    @property
    def count(self) -> int:
        """Return the number of interruptions so far."""
        return sum(map(len, self.delays.values()))


def main() -> int:
    """Run the benchmark; return 1 if a check failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--photos", type=Path, help="default: those of a small generated gym")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    chance = random.Random(args.seed)
    tally = Tally()
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        photos = args.photos
        if photos is None:
            write_tiny_gym(work / "gym")
            photos = work / "gym" / "photos"
        # Use equal names, because the page contains the folder's name.
        calm, shaken = work / "calm" / "scan", work / "shaken" / "scan"
        begin = time.monotonic()
        subprocess.run(command(photos, calm), check=True)
        length = time.monotonic() - begin
        print(f"undisturbed: {length:.0f} s")
        with suppress(KeyboardInterrupt):  # Ctrl-C prints the findings so far
            while tally.count < args.count:
                if interrupt(photos, shaken, chance, length, tally):
                    continue
                compare(calm, shaken, tally)
                shutil.rmtree(shaken)
            subprocess.run(command(photos, shaken), check=True)
            compare(calm, shaken, tally)
    return report(tally)


def command(photos: Path, out: Path) -> list[str]:
    """Return the command of the scan."""
    return [sys.executable, "-m", "walltopo", "scan", str(photos), "-o", str(out), "-q", *SETTINGS]


def interrupt(photos: Path, out: Path, chance: random.Random, length: float, tally: Tally) -> bool:
    """Start or continue the scan and interrupt it; return False if it ended before the signal."""
    process = subprocess.Popen(
        command(photos, out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        process.wait(chance.uniform(0.0, 0.6 * length))
    except subprocess.TimeoutExpired:
        pass
    except KeyboardInterrupt:
        process.kill()
        raise
    else:
        if process.returncode != 0:
            tally.wrong.append(f"a run failed: {process.communicate()[1][-500:]}")
        return False
    number = chance.choice(SIGNALS)
    stage = running(out)
    process.send_signal(number)
    begin = time.monotonic()
    output = process.communicate()[1]
    if process.returncode == 0:
        return False  # it ended just before the signal
    tally.delays[number].append(time.monotonic() - begin)
    tally.stages[stage] += 1
    wanted = -number if number == signal.SIGKILL else 128 + number
    early = process.returncode == -number  # the signal came before any import
    if process.returncode != wanted and not early:
        tally.wrong.append(f"{number.name} in {stage}: exit {process.returncode}")
    if "race" in output:  # matches a traceback and COLMAP's stack trace
        tally.wrong.append(f"{number.name} in {stage}: {output[-500:]}")
    for file in out.glob("*.json"):
        try:
            json.loads(file.read_bytes())
        except ValueError:
            tally.wrong.append(f"{number.name} in {stage}: {file.name} is half-written")
    print(f"{tally.count:4d} {number.name:8} in {stage}", flush=True)
    return True


def running(out: Path) -> str:
    """Return the stage that `scan.json` marks as running."""
    stages = Manifest.load(out / "scan.json").stages
    at = next((name for name, record in stages.items() if record.state == "running"), "between")
    return at if stages else "start"


def compare(calm: Path, shaken: Path, tally: Tally) -> None:
    """Note every file that differs between the two scans."""
    tally.compared += 1
    one, two = contents(calm), contents(shaken)
    names = sorted(one.keys() | two.keys())
    tally.wrong += [f"{name} differs" for name in names if one.get(name) != two.get(name)]
    tally.wrong += [f"{left.name} is left over" for left in shaken.rglob(".partial-*")]


def contents(scan: Path) -> dict[str, bytes]:
    """Return the content of each file that must be equal."""
    names = {file.relative_to(scan).as_posix(): file for file in files_below(scan)}
    return {name: f.read_bytes() for name, f in names.items() if not name.startswith(APART)}


def report(tally: Tally) -> int:
    """Print the tally and return the exit code."""
    for number in SIGNALS:
        delays = tally.delays[number]
        if delays:
            print(
                f"{number.name}: {len(delays)} times, ended after {statistics.median(delays):.2f} s "
                f"(median), {max(delays):.2f} s at most"
            )
    print("in: " + ", ".join(f"{stage} {count}" for stage, count in tally.stages.most_common()))
    print(f"{tally.compared} scans ended and were compared file by file")
    print("\n".join(tally.wrong) or "all files the same, nothing half-written, every stop told")
    return 1 if tally.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
