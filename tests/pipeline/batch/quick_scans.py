"""A batch of small scans that share one set of photos."""

from __future__ import annotations

import json
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
