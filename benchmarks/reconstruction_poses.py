"""Camera poses, scale, up and floor of a scan against exact truth.

    python -m benchmarks.reconstruction_poses truth SCAN TRUTH [--update SCAN TRUTH]...
    python -m benchmarks.reconstruction_poses gym-a --data DATA --out FOLDER

`truth` evaluates finished scans. `gym-a` runs ingest, sparse and scale on gym-a, then on
gym-a-reset registered into it both ways, and evaluates all three.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.pipeline.runner import run_stage, write_sources
from walltopo.pipeline.settings import Settings
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.scale import Aligned

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FloorFit:
    """A rotation about z and a shift along the floor (never in height) from scan to truth."""

    rotation: Floats
    shift: Floats

    def apply(self, points: Floats) -> Floats:
        return points @ self.rotation.T + self.shift


def fit_on_floor(scan: Floats, truth: Floats) -> FloorFit:
    """Return the least-squares heading and position on the floor of matched points (n, 3)."""
    a, b = scan[:, :2] - scan[:, :2].mean(axis=0), truth[:, :2] - truth[:, :2].mean(axis=0)
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    shift = truth.mean(axis=0) - rotation @ scan.mean(axis=0)
    shift[2] = 0.0
    return FloorFit(rotation, shift)


def centres(poses: Floats) -> Floats:
    """Return (n, 3) camera centres of (n, 3, 4) cam_from_world."""
    return -np.einsum("nji,nj->ni", poses[:, :, :3], poses[:, :, 3])


def load_truth(folder: Path) -> dict[str, Floats]:
    """Return photo name to its true cam_from_world (3, 4); poses are in the order of the names."""
    poses = np.load(folder / "gt.npz")["cam_from_world"]
    names = sorted(path.name for path in (folder / "photos").iterdir())
    return dict(zip(names, poses, strict=True))


def matched(views: list[View], truth: dict[str, Floats]) -> tuple[Floats, Floats]:
    """Return the poses of scan and truth, (n, 3, 4) each, of the registered photos."""
    scan = np.array([view.cam_from_world for view in views])
    return scan, np.array([truth[view.name] for view in views])


HEAD = (
    "| scan | registered | camera centres, median / worst | bend, median / worst | scale | up "
    "| floor | reference moved |\n|---|---|---|---|---|---|---|---|"
)


def _millimetres(lengths: Floats) -> str:
    """Return the median and the maximum of lengths in metres, as text."""
    return f"{1000 * np.median(lengths):.2f} / {1000 * lengths.max():.2f} mm"


def judge(
    label: str, views: list[View], truth: dict[str, Floats], fit: FloorFit, rest: Sequence[str]
) -> None:
    """Print one row of the table."""
    scan, real = matched(views, truth)
    apart = np.linalg.norm(fit.apply(centres(scan)) - centres(real), axis=1)
    cells = [label, f"{len(views)} of {len(truth)}", _millimetres(apart), *rest]
    print(f"| {' | '.join(cells)} |", flush=True)


def frame_cells(scan: Floats, real: Floats) -> list[str]:
    """Return bend, scale, up and floor of a scan in its own frame; poses (n, 3, 4)."""
    a, b = centres(scan), centres(real)
    a0, b0 = a - a.mean(axis=0), b - b.mean(axis=0)
    u, singular, vt = np.linalg.svd(b0.T @ a0)
    scale = singular.sum() / (a0**2).sum()
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    tilt = np.degrees(np.arccos(np.clip(rotation[2, 2], -1, 1)))
    # The error that a full similarity leaves.
    bend = np.linalg.norm(scale * a0 @ rotation.T - b0, axis=1)
    # Map the scan's floor point z = 0 under the cameras' mean to the truth by the full fit.
    below = np.array([*a.mean(axis=0)[:2], 0.0])
    height = scale * rotation @ (below - a.mean(axis=0)) + b.mean(axis=0)
    return [
        _millimetres(bend),
        f"{100 * (1 / scale - 1):+.4f} %",
        f"{tilt:.3f}°",
        f"{1000 * height[2]:+.2f} mm",
    ]


def judge_scan(folder: Path, truth_folder: Path) -> FloorFit:
    """Print the row of a scan in its own frame; return the fit to the truth."""
    views = read_views(ScanFolder(folder).sparse)
    truth = load_truth(truth_folder)
    scan, real = matched(views, truth)
    fit = fit_on_floor(centres(scan), centres(real))
    judge(f"`{truth_folder.name}`", views, truth, fit, [*frame_cells(scan, real), ""])
    return fit


def judge_update(folder: Path, truth_folder: Path, fit: FloorFit) -> None:
    """Print the row of an aligned update in its reference's frame, without a fit to its own
    cameras.
    """
    scan = ScanFolder(folder)
    aligned = Aligned.load(scan.aligned)
    label = f"`{truth_folder.name}` into it, `{aligned.align}`"
    rest = ["", "", "", "", f"{aligned.reference_moved:.0e}"]
    judge(label, read_views(scan.sparse), load_truth(truth_folder), fit, rest)


def run_stages(
    folder: Path, names: Sequence[str], settings: Settings, photos: Sequence[Path] = ()
) -> None:
    """Run stages of a scan; print wall and CPU seconds of each."""
    scan = ScanFolder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if photos:
        write_sources(scan, photos)
    for name in names:
        clock, cpu = time.perf_counter(), cpu_seconds()
        metrics = run_stage(scan, name, getattr(settings, name))
        spent = f"{time.perf_counter() - clock:6.1f} s, {cpu_seconds() - cpu:6.1f} CPU-s"
        print(f"{folder.name} {name:7s} {spent}: {metrics}", flush=True)


def run_to_scale(photos: Path, folder: Path, sparse: SparseSettings | None = None) -> None:
    """Run ingest, sparse and scale."""
    settings = Settings(sparse=sparse or SparseSettings())
    run_stages(folder, ("ingest", "sparse", "scale"), settings, (photos,))


def cpu_seconds() -> float:
    """Return the CPU-seconds of this process and of its ended children."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(resource.getrusage(k).ru_utime + resource.getrusage(k).ru_stime for k in kinds)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    truth = commands.add_parser("truth", help="judge finished scans")
    truth.add_argument("scan", type=Path)
    truth.add_argument("truth", type=Path)
    truth.add_argument("--update", nargs=2, type=Path, action="append", default=[])
    gym = commands.add_parser("gym-a", help="run and judge gym-a and its reset")
    gym.add_argument("--data", type=Path, required=True, help="folder that holds gym-a")
    gym.add_argument("--out", type=Path, required=True)
    gym.add_argument("--reuse", action="store_true", help="judge what is already there")
    args = parser.parse_args()
    if args.command == "truth":
        print(HEAD)
        fit = judge_scan(args.scan, args.truth)
        for folder, truth_folder in args.update:
            judge_update(folder, truth_folder, fit)
        return 0
    names: dict[Literal["constrained", "rigid"], Path] = {
        "constrained": args.out / "reset-constrained",
        "rigid": args.out / "reset-rigid",
    }
    if not args.reuse:
        run_to_scale(args.data / "gym-a" / "photos", args.out / "gym-a")
        for align, folder in names.items():
            reference = str(args.out / "gym-a")
            photos = args.data / "gym-a-reset" / "photos"
            run_to_scale(photos, folder, SparseSettings(reference=reference, align=align))
    print(HEAD)
    fit = judge_scan(args.out / "gym-a", args.data / "gym-a")
    for folder in names.values():
        judge_update(folder, args.data / "gym-a-reset", fit)
    return 0


if __name__ == "__main__":
    sys.exit(main())
