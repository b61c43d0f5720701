"""Photos of generated smooth walls that are placed, over their number.

    python -m benchmarks.smooth_walls OUT [--seeds 201 202 203 204]

Walls of 8 m with little wear and few holds, photographed at 0.8 MP and denoised as phones do, which
leaves little of the paint's texture. Each line has all walls at one number of photos: all of them,
every second, third and fourth; the overlap is the share of what a photo shows that its best
neighbour shows, too, the median over photos. Photos carry no focal length. A photo counts as placed
right within 5 cm of its true place, after a similarity fit to the best three cameras. CPU seconds
are those of the stage, as a ratio to SIFT's on the same photos in the same run; with stickers, to
SIFT's without. The scale is that by the stickers alone, the median over walls of its error. `two
walls` mixes the photos of two walls: those of the smaller group that are joined to the larger one
are counted.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.reconstruction_poses import centres
from benchmarks.registration import Features, cpu_seconds, put_photos
from walltopo.core import InputError, StageError
from walltopo.geometry.similarity import fit_similarity
from walltopo.images.files import read_rgb
from walltopo.pipeline.runner import run_stage
from walltopo.reconstruct.settings import ScaleSettings, SparseSettings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.scale import Scale
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.recipe import Recipe, generate

Floats = NDArray[np.float64]

STICKERS = 16  # two per metre of wall
_RIGHT_M = 0.05
GYM = GymSettings(wear=0.0, chalk=0.1, routes=4, volumes=2, facets=0.2)
PHOTOS = PhotoSettings(
    photos=18,
    width=1024,
    height=768,
    noise=1.5,
    measure_share=0.0,
    distance_low=2.0,
    distance_high=3.2,
)


@dataclass(frozen=True, eq=False)
class SmoothWall:
    """Denoised photos of a wall.

    Parameters
    ----------
    files : the photos.
    truth : true camera centre (3,) of each photo, by its name.
    overlaps : (n, n) share of what photo i shows that photo j shows, too.
    """

    files: Sequence[Path]
    truth: dict[str, Floats]
    overlaps: Floats


def _gym(stickers: int) -> GymSettings:
    """Return the settings of the walls; stickers replace the plate on the floor."""
    return replace(GYM, stickers=stickers, plates=0) if stickers else GYM


def make_wall(out: Path, seed: int, stickers: int = 0) -> SmoothWall:
    """Generate and photograph a wall, and denoise its photos; what is there already is kept."""
    folder = out / (f"{seed}-{stickers}" if stickers else f"{seed}")
    generate(folder, Recipe(_gym(stickers), PHOTOS, seed=seed))
    with np.load(folder / "truth" / "gt.npz") as truth:
        poses = centres(truth["cam_from_world"])
        overlaps = shared_shares(truth)
    smooth = folder / "smooth"
    smooth.mkdir(exist_ok=True)
    files = []
    for photo in sorted((folder / "photos").iterdir()):
        files.append(smooth / f"{seed}-{photo.name}")
        if not files[-1].exists():
            pixels = np.ascontiguousarray(read_rgb(photo)[:, :, ::-1])
            clean = cv2.fastNlMeansDenoisingColored(pixels, None, 7, 7, 5, 15)
            cv2.imwrite(str(files[-1]), clean, [cv2.IMWRITE_JPEG_QUALITY, 75])
    places = {file.name: place for file, place in zip(files, poses, strict=True)}
    return SmoothWall(files, places, overlaps)


def shared_shares(truth: Mapping[str, Floats]) -> Floats:
    """Return (n, n) the share of the wall's points in photo i that photo j shows, too.

    A point hidden behind a volume counts as shown, and lens distortion is ignored.
    """
    points = truth["vertices"][::20]
    fx, fy, cx, cy = truth["intrinsics"]
    in_camera = points @ truth["cam_from_world"][:, :, :3].transpose(0, 2, 1)
    in_camera += truth["cam_from_world"][:, None, :, 3]
    x, y, z = np.moveaxis(in_camera, -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = fx * x / z + cx, fy * y / z + cy
    width, height = truth["size"]
    shown = (z > 0) & (u > 0) & (u < width) & (v > 0) & (v < height)
    both = shown.astype(np.float64) @ shown.T
    return np.asarray(both / shown.sum(axis=1)[:, None])


@dataclass(frozen=True, eq=False)
class Placed:
    """The camera centre (3,) of each placed photo, CPU seconds, and metres per unit if known."""

    centres: dict[str, Floats]
    seconds: float
    metric: bool = False


def place(files: Sequence[Path], features: Features) -> Placed:
    """Run the stage `sparse` on photos, and `scale` where it placed some."""
    before = cpu_seconds()
    with tempfile.TemporaryDirectory() as work:
        scan = put_photos(Path(work) / "scan", files, 1)
        try:
            run_stage(scan, "sparse", SparseSettings(features=features))
        except StageError:
            return Placed({}, cpu_seconds() - before)
        seconds = cpu_seconds() - before
        run_stage(scan, "scale", ScaleSettings())
        views = read_views(scan.sparse)
        metric = Scale.load(scan.scale).metric
    return Placed({view.name: view.centre for view in views}, seconds, metric)


@dataclass(frozen=True, eq=False)
class Judged:
    """Distance (n,) of each placed camera from its true place, metres; relative error of scale."""

    away: Floats
    scale_error: float


def judge(placed: Placed, truth: dict[str, Floats]) -> Judged:
    """Compare cameras with the truth.

    The fit is to the three cameras that leave the smallest median error: one wrong camera moves no
    other.
    """
    found = placed.centres
    best, scale = np.full(len(found), np.inf), np.nan
    if len(found) < 3:
        return Judged(best, scale)
    mine, real = np.array(list(found.values())), np.array([truth[name] for name in found])
    for chosen in combinations(range(len(mine)), 3):
        try:
            fit = fit_similarity(mine[list(chosen)], real[list(chosen)])
        except InputError:  # three cameras on a line
            continue
        away = np.linalg.norm(fit.apply(mine) - real, axis=1)
        if np.median(away) < np.median(best):
            best = away
    right = best <= _RIGHT_M
    if placed.metric and right.sum() >= 3:
        scale = abs(fit_similarity(mine[right], real[right]).scale - 1)
    return Judged(best, scale)


def rows(walls: Sequence[SmoothWall], stuck: Sequence[SmoothWall], step: int) -> None:
    """Print the lines of all walls at one number of photos; `stuck` have stickers."""
    once = 0.0
    lines: tuple[tuple[str, Features, Sequence[SmoothWall]], ...] = (
        ("`sift`", "sift", walls),
        ("`auto`", "auto", walls),
        (f"`auto`, {STICKERS} stickers", "auto", stuck),
    )
    for label, features, chosen in lines:
        results = [place(wall.files[::step], features) for wall in chosen]
        judged = [judge(one, wall.truth) for one, wall in zip(results, chosen, strict=True)]
        spent = sum(one.seconds for one in results)
        once = once or spent
        away = np.concatenate([one.away for one in judged])
        right = away[away <= _RIGHT_M]
        total = sum(len(wall.files[::step]) for wall in chosen)
        scales = [one.scale_error for one in judged if np.isfinite(one.scale_error)]
        cells = [
            f"{len(chosen[0].files[::step]) / GYM.width:.1f}",
            f"{100 * _overlap(chosen, step):.0f} %",
            label,
            f"{100 * len(right) / total:.0f} %",
            str(len(away) - len(right)),
            f"{1000 * np.median(right):.1f} mm" if len(right) else "",
            f"{100 * np.median(scales):.2f} %" if scales else "",
            f"{spent / once:.1f}",
        ]
        print(f"| {' | '.join(cells)} |", flush=True)


def _overlap(walls: Sequence[SmoothWall], step: int) -> float:
    """Return the median over photos of the overlap with the best neighbour."""
    best = []
    for wall in walls:
        shares = wall.overlaps[::step, ::step].copy()
        np.fill_diagonal(shares, 0)
        best += shares.max(axis=1).tolist()
    return float(np.median(best))


def joined(larger: SmoothWall, smaller: SmoothWall) -> str:
    """Return how many photos of another wall are joined to a wall."""
    files = [*larger.files[::2], *smaller.files[::3]]
    found = place(files, "auto").centres
    own = sum(name in larger.truth for name in found)
    return f"{min(own, len(found) - own)} of {len(smaller.files[::3])}"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("--seeds", type=int, nargs="+", default=[201, 202, 203, 204])
    args = parser.parse_args(arguments)
    walls = [make_wall(args.out, seed) for seed in args.seeds]
    stuck = [make_wall(args.out, seed, STICKERS) for seed in args.seeds]
    print(
        "| photos per metre | overlap | features | placed right | wrong | median | scale | "
        "CPU, SIFT = 1 |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for step in (1, 2, 3, 4):
        rows(walls, stuck, step)
    print("\nTwo walls, photos joined to the wrong one:")
    print(", ".join(joined(*both) for both in pairwise(walls)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
