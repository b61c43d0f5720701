"""Registered photos by feature type, for few or small photos or a smooth wall.

    python -m benchmarks.registration DATA

Photos of `gym-a` at half size, every third and every fourth, against its exact truth; and the five
overlapping photos of `holds-liam`. Photos carry no focal length, like those of a set whose
publisher removed it. CPU seconds are those of the stage with its child processes, as a ratio to
SIFT's in the same run.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from benchmarks.reconstruction_poses import centres, load_truth
from walltopo.core import StageError
from walltopo.geometry.similarity import fit_similarity
from walltopo.images.files import read_rgb
from walltopo.pipeline.runner import run_stage
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import Photo, PhotoList

Features = Literal["sift", "auto"]
FEATURES: tuple[Features, ...] = ("sift", "auto")


def put_photos(folder: Path, files: Sequence[Path], shrink: int) -> ScanFolder:
    """Write a scan folder in the state after ingest; return it."""
    scan = ScanFolder(folder)
    scan.photos.mkdir(parents=True)
    entries = []
    for file in files:
        small = Image.fromarray(read_rgb(file)).reduce(shrink)
        small.save(scan.photos / file.name, quality=95)
        entries.append(Photo(file.name, small.width, small.height, None, file.name, 100.0))
    PhotoList(photos=tuple(entries)).save(scan.photo_list)
    return scan


def placed(
    files: Sequence[Path], shrink: int, features: Features, truth: Path | None
) -> tuple[str, float]:
    """Return the number and accuracy of registered photos, in words, and CPU seconds."""
    before = cpu_seconds()
    with tempfile.TemporaryDirectory() as work:
        scan = put_photos(Path(work) / "scan", files, shrink)
        try:
            run_stage(scan, "sparse", SparseSettings(features=features))
        except StageError:
            return f"0 of {len(files)}", cpu_seconds() - before
        views = read_views(scan.sparse_raw)
    cell = f"{len(views)} of {len(files)}"
    if truth is None:
        return cell, cpu_seconds() - before
    poses = load_truth(truth)
    found = np.array([view.centre for view in views])
    real = centres(np.array([poses[view.name] for view in views]))
    away = 1000 * np.linalg.norm(fit_similarity(found, real).apply(found) - real, axis=1)
    return f"{cell}, {np.median(away):.1f} / {away.max():.1f} mm", cpu_seconds() - before


def cpu_seconds() -> float:
    """Return the CPU seconds of this process and its ended children."""
    return sum(os.times()[:4])


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, metavar="DATA")
    data: Path = parser.parse_args(arguments).data
    gym = sorted((data / "gym-a" / "photos").glob("*.jpg"))
    liam = sorted((data / "holds-liam" / "overlap").glob("*.jpg"))
    rows: list[tuple[str, Sequence[Path], int, Path | None]] = [
        ("`gym-a`, every third at half size", gym[::3], 2, data / "gym-a"),
        ("`gym-a`, every fourth at half size", gym[::4], 2, data / "gym-a"),
        ("`holds-liam/overlap`", liam, 1, None),
    ]
    print(
        "| photos | features | placed, centres median / worst | CPU, SIFT = 1 |\n|---|---|---|---|"
    )
    for label, files, shrink, truth in rows:
        once = 0.0
        for features in FEATURES:
            cell, spent = placed(files, shrink, features, truth)
            once = once or spent
            print(f"| {label} | `{features}` | {cell} | {spent / once:.1f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
