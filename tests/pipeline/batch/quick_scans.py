"""A batch of small scans that share one set of photos."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path

# Seconds for a scan, and the same bytes on every run.
SETTINGS = (
    "dense.backend=sparse sparse.threads=1 texture.size=256 detect.size=480 detect.again=0 "
    "detect.threads=1"
)


def write_list(folder: Path, photos: Path, names: Sequence[str], settings: str = SETTINGS) -> Path:
    """A CSV list that makes a scan of the same photos under each name."""
    rows = [f"{photos},{name},{settings}" for name in names]
    path = folder / "list.csv"
    path.write_text("\n".join(["photos,out,settings", *rows]) + "\n", encoding="utf-8")
    return path


def stage_seconds(scan: Path) -> dict[str, float]:
    """Seconds of each finished stage, by its manifest."""
    stages = json.loads((scan / "scan.json").read_text(encoding="utf-8"))["stages"]
    return {name: stage["seconds"] for name, stage in stages.items() if stage["state"] == "done"}


def writer_of(log: Path) -> int:
    """The process that writes a scan's log, once it has begun."""
    until = time.monotonic() + 600
    while time.monotonic() < until:
        if log.is_file() and "process " in (text := log.read_text(encoding="utf-8")):
            return int(text.split("process ")[1].split()[0])
        time.sleep(0.02)
    raise AssertionError(f"{log} was not begun")
