"""Every reader on damaged files: crashes, hangs over 10 s, more than 2 GB, and defects.

    python -m benchmarks.fuzz --seconds 120                    all targets together
    python -m benchmarks.fuzz --seconds 3600 --target coco     one, for an hour

Files are damaged by a seed and read in a watched process. A file with a new message is damaged
further. A finding is kept in tools/tests/fuzz/corpus, from which the tests read it.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import random
import re
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tools.fuzz.mutate import damaged
from tools.fuzz.targets import TARGETS, Files, seeds
from tools.fuzz.watched import Outcome, Watched

CORPUS = Path(__file__).parents[1] / "tools" / "tests" / "fuzz" / "corpus"
_LARGEST_POOL = 2000
_LARGEST_FILE = 200_000


@dataclass
class Run:
    """The results of one target.

    Parameters
    ----------
    counts : executions by kind of outcome.
    finds : files and outcome of each finding, by the outcome's text without its numbers.
    """

    counts: Counter[str] = field(default_factory=Counter[str])
    finds: dict[str, tuple[Files, Outcome]] = field(
        default_factory=dict[str, tuple[Files, Outcome]]
    )


def kept(target: str) -> dict[str, Files]:
    """Return the kept files of a target by the name of their folder."""
    root = CORPUS / target
    folders = sorted(root.iterdir()) if root.is_dir() else []
    return {
        folder.name: {
            item.relative_to(folder).as_posix(): item.read_bytes()
            for item in sorted(folder.rglob("*"))
            if item.is_file()
        }
        for folder in folders
    }


def keep(target: str, files: Files) -> Path:
    """Keep the files of a finding in the corpus; return their folder."""
    name = hashlib.blake2b(repr(sorted(files.items())).encode(), digest_size=6).hexdigest()
    for file, data in files.items():
        path = CORPUS / target / name / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return CORPUS / target / name


def _kind_of(outcome: Outcome) -> str:
    """Return the outcome's text without its file-specific parts."""
    text = re.sub(r"'[^']*'|`[^`]*`|\"[^\"]*\"", "", outcome.text)
    return outcome.kind + re.sub(r"\d+", "", text)[:120]


def fuzz(watched: Watched, target: str, first: int, until: Iterator[bool]) -> Run:
    """Damage and read files while `until` yields True; equal `first` seeds give equal runs."""
    run, seen = Run(), set[str]()
    whole = seeds(target)
    pool = [*whole, *kept(target).values()]
    for seed in itertools.count(first):
        if not next(until):
            return run
        rng = random.Random(seed)
        files = damaged(rng.choice(whole if rng.random() < 0.3 else pool), list(pool), seed)
        outcome = watched.read(target, files)
        run.counts[outcome.kind] += 1
        kind = _kind_of(outcome)
        if outcome.bad and kind not in run.finds:
            run.finds[kind] = (files, outcome)
        elif kind not in seen and len(pool) < _LARGEST_POOL:
            seen.add(kind)
            if sum(map(len, files.values())) < _LARGEST_FILE:
                pool.append(files)
    raise AssertionError("unreachable")


def lasting(seconds: float) -> Iterator[bool]:
    """Yield True until the time is over, then False."""
    end = time.monotonic() + seconds
    while True:
        yield time.monotonic() < end


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=120, help="in all (120)")
    parser.add_argument("--target", choices=TARGETS, action="append", help="only this; repeatable")
    parser.add_argument("--seed", type=int, default=0, help="another gives other damage")
    args = parser.parse_args()
    targets: list[str] = args.target or list(TARGETS)
    print("| target | executions | read | refused | finds |\n|---|---|---|---|---|")
    with Watched() as watched:
        for target in targets:
            run = fuzz(watched, target, args.seed, lasting(args.seconds / len(targets)))
            counts, total = run.counts, run.counts.total()
            print(
                f"| {target} | {total} | {counts['read']} | {counts['refused']} | {len(run.finds)} |",
                flush=True,
            )
            for files, outcome in run.finds.values():
                print(f"  {outcome.kind}: {outcome.text}\n    {keep(target, files)}", flush=True)


if __name__ == "__main__":
    main()
