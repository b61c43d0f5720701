"""Photos of generated ordinary walls that are placed right, with and without ALIKED.

    python -m benchmarks.ordinary_photos OUT [--seeds 321 322 323 324]

The walls are hard as real ones are: smooth paint, a regular grid of bolt holes, equal panels, and a
few hold models that are set many times. The photos are what people send: 768x1024 without EXIF,
from 1 to 5 m, denoised and compressed by a messenger, with an exposure that jumps, some turned by a
quarter. Seeds 301 to 304 chose the settings of the product; seeds 321 and above report.

A photo counts as right within 5 cm and 5 degrees of its true pose, after a similarity fit to most
cameras; all other registered photos are wrong. CPU seconds are those of the stage. The pairs are
those that COLMAP verified in the databases of XFeat and of ALIKED, each with SIFT's matches; false
ones show no common part of the wall.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from unittest.mock import patch

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.reconstruction_poses import centres
from benchmarks.registration import cpu_seconds, put_photos
from benchmarks.smooth_walls import shared_shares
from walltopo.core import InputError, StageError
from walltopo.geometry.colmap import pycolmap
from walltopo.geometry.similarity import fit_similarity
from walltopo.pipeline.runner import run_stage
from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse import attempts
from walltopo.reconstruct.sparse.larger_network import require_larger_network
from walltopo.scans.colmap_model import open_model, read_views
from walltopo_lab.synth.bodies import Body
from walltopo_lab.synth.develop import develop, draw_exposure
from walltopo_lab.synth.gym import Gym, make_gym
from walltopo_lab.synth.holds import make_hold
from walltopo_lab.synth.params import GymSettings, PhotoSettings
from walltopo_lab.synth.path import look_at, phone_camera
from walltopo_lab.synth.render import Renderer

Floats = NDArray[np.float64]
Pair = tuple[str, str]

REPORTING = (321, 322, 323, 324)
_RIGHT_M = 0.05
_RIGHT_DEG = 5.0
GYM = GymSettings(
    width=11.0,
    columns=7,
    facets=0.0,
    corner_deg=10.0,
    overhang_max_deg=20.0,
    wear=0.0,
    chalk=0.1,
    routes=7,
    volumes=1,
    footholds=0.2,
    downclimb=0,
    plates=0,
)
PHOTOS = PhotoSettings(
    photos=17,
    width=768,
    height=1024,
    noise=1.5,
    exposure_spread=0.5,
    blur_px=0.8,
    distance_low=1.0,
    distance_high=5.0,
)
_MODELS_PER_KIND = 2  # different holds of one kind and style on a wall
_QUARTER_TURNS = 0.2  # share of the photos that are turned
_JPEG_QUALITY = 65
_MIN_OVERLAP = 0.02  # share of what one photo shows


@dataclass(frozen=True, eq=False)
class OrdinaryWall:
    """Photos of a wall.

    Parameters
    ----------
    files : the photos.
    truth : true cam_from_world (3, 4) of each photo, by its name.
    overlaps : (n, n) share of what photo i shows that photo j shows, too.
    """

    files: Sequence[Path]
    truth: dict[str, Floats]
    overlaps: Floats


class _FewModels:
    """A source of holds that repeats a few models of each kind and style."""

    def __init__(self, detail: float) -> None:
        self._detail = detail
        self._made: dict[tuple[str, str, int], Body] = {}

    def __call__(self, kind: str, style: str, rng: np.random.Generator, scale: float) -> Body:
        key = kind, style, int(rng.integers(_MODELS_PER_KIND))
        if key not in self._made:
            self._made[key] = make_hold(kind, style, rng, 1.0, self._detail)
        return self._made[key]


def make_wall(
    out: Path, seed: int, gym: GymSettings = GYM, photos: PhotoSettings = PHOTOS
) -> OrdinaryWall:
    """Generate and photograph a wall; photos that are there already are kept."""
    folder = out / str(seed)
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{seed}-{k:02d}.jpg" for k in range(photos.photos)]
    known = folder / "truth.npz"
    if not known.is_file():
        built = make_gym(gym, seed, make_hold=_FewModels(gym.detail))
        poses = draw_poses(built, photos, np.random.default_rng([seed, 1]))
        _photograph(built, photos, poses, files, seed)
        camera = phone_camera(photos)
        truth = {
            "vertices": built.surface.vertices.astype(np.float64),
            "cam_from_world": np.array(poses),
            "intrinsics": np.array([camera.fx, camera.fx, camera.cx, camera.cy]),
            "size": np.array([camera.width, camera.height]),
        }
        np.savez(known, overlaps=shared_shares(truth), cam_from_world=truth["cam_from_world"])
    with np.load(known) as stored:
        places = dict(zip((file.name for file in files), stored["cam_from_world"], strict=True))
        return OrdinaryWall(files, places, stored["overlaps"])


def draw_poses(gym: Gym, photos: PhotoSettings, rng: np.random.Generator) -> list[Floats]:
    """Return cam_from_world of photos that people take here and there along a wall."""
    corners = np.concatenate([facet.corners for facet in gym.wall])
    low, high = corners[:, 0].min() + 0.7, corners[:, 0].max() - 0.7
    poses = []
    for k in range(photos.photos):
        aim_x = low + (high - low) * (k + rng.uniform(0.1, 0.9)) / photos.photos
        near, far = np.log([photos.distance_low, photos.distance_high])
        depth = float(np.exp(rng.uniform(near, far)))
        close = corners[np.abs(corners[:, 0] - aim_x) < 2.5]
        middle = close[:, 1].mean()
        eye_y = min(middle - depth, close[:, 1].min() - 0.9)
        eye = np.array([aim_x + rng.normal(0, 0.25) * depth, eye_y, rng.normal(1.55, 0.12)])
        aim_z = gym.settings.height * rng.uniform(0.3, 0.62)
        turned = rng.choice([-90.0, 90.0]) if rng.random() < _QUARTER_TURNS else 0.0
        roll = np.radians(turned + rng.normal(0, photos.roll_deg))
        poses.append(look_at(eye, np.array([aim_x, middle, aim_z]), roll))
    return poses


def _photograph(
    gym: Gym, photos: PhotoSettings, poses: Sequence[Floats], files: Sequence[Path], seed: int
) -> None:
    """Write the photos as a messenger passes them on: denoised, compressed, without EXIF."""
    renderer, camera = Renderer(gym), phone_camera(photos)
    for k, (pose, file) in enumerate(zip(poses, files, strict=True)):
        rng = np.random.default_rng([seed, 2, k])
        linear, _ = renderer.render(camera, pose, photos.samples)
        pixels = develop(linear, draw_exposure(photos, gym.settings.light, rng), rng)
        bgr = np.ascontiguousarray(pixels[:, :, ::-1])
        clean = cv2.fastNlMeansDenoisingColored(bgr, None, 7, 7, 5, 15)
        cv2.imwrite(str(file), clean, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])


@dataclass(frozen=True, eq=False)
class Placed:
    """The result of the stage `sparse`.

    Parameters
    ----------
    poses : cam_from_model (3, 4) of each registered photo, by its name.
    points : points of the model.
    seconds : CPU seconds.
    strategy : the strategy of the best attempt, "" if the stage failed.
    pairs : image names of the verified pairs, by the strategy of the database.
    """

    poses: dict[str, Floats]
    points: int
    seconds: float
    strategy: str
    pairs: Mapping[str, Collection[Pair]] = field(default_factory=dict[str, list[Pair]])


def place(files: Sequence[Path], *, larger: bool) -> Placed:
    """Run the stage `sparse` on photos.

    Parameters
    ----------
    larger : whether the larger network may be used; its package must be installed.

    Raises
    ------
    EnvironmentLacksError : `larger` is true, and the package is missing.
    """
    networks = require_larger_network() if larger else None
    before = cpu_seconds()
    with (
        tempfile.TemporaryDirectory() as work,
        patch.object(attempts, "larger_network_files", lambda: networks),
    ):
        scan = put_photos(Path(work) / "scan", files, 1)
        try:
            strategy = str(run_stage(scan, "sparse", SparseSettings())["means"])
        except StageError:
            strategy = ""
        seconds = cpu_seconds() - before
        databases = Path(work).rglob("features.*/features.db")
        pairs = {path.parent.suffix[1:]: verified_pairs(path) for path in databases}
        if not strategy:
            return Placed({}, 0, seconds, strategy, pairs)
        views = read_views(scan.sparse_raw)
        points = open_model(scan.sparse_raw).num_points3D()
    poses = {view.name: view.cam_from_world for view in views}
    return Placed(poses, points, seconds, strategy, pairs)


def verified_pairs(database: Path) -> list[Pair]:
    """Return the image names of the pairs that COLMAP verified."""
    with pycolmap.Database.open(database) as db:
        names = {image.image_id: str(image.name) for image in db.read_all_images()}
        counts = zip(*db.read_two_view_geometry_num_inliers(), strict=True)
        pairs = [pycolmap.pair_id_to_image_pair(pair) for pair, count in counts if count]
    return [(names[a], names[b]) for a, b in pairs]


def right_photos(found: Mapping[str, Floats], truth: Mapping[str, Floats]) -> set[str]:
    """Return the names of the photos whose pose is right after a robust similarity fit.

    The fit starts from the three cameras with which most others agree: wrong cameras move no right
    one. Fewer than three cameras cannot be compared.
    """
    names = sorted(found)
    if len(names) < 3:
        return set()
    mine, real = (centres(np.array([poses[name] for name in names])) for poses in (found, truth))
    best = np.full(len(names), np.inf)
    for chosen in combinations(range(len(names)), 3):
        rows = list(chosen)
        try:
            away = _apart(mine, real, rows)
        except InputError:  # three cameras on a line
            continue
        if np.minimum(away, 2 * _RIGHT_M).sum() < np.minimum(best, 2 * _RIGHT_M).sum():
            best = away
    agreeing = np.flatnonzero(best <= 2 * _RIGHT_M)
    if len(agreeing) < 3:
        return set()
    fit = fit_similarity(mine[agreeing], real[agreeing])
    away = np.linalg.norm(fit.apply(mine) - real, axis=1)
    turned = [_angle(found[name][:, :3] @ fit.rotation.T, truth[name][:, :3]) for name in names]
    return {
        name
        for name, metres, degrees in zip(names, away, turned, strict=True)
        if metres <= _RIGHT_M and degrees <= _RIGHT_DEG
    }


def _apart(mine: Floats, real: Floats, rows: list[int]) -> Floats:
    fit = fit_similarity(mine[rows], real[rows])
    return np.asarray(np.linalg.norm(fit.apply(mine) - real, axis=1))


def _angle(one: Floats, other: Floats) -> float:
    """Return the angle between two rotations, degrees."""
    return float(np.degrees(np.arccos(np.clip((np.trace(one @ other.T) - 1) / 2, -1, 1))))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(REPORTING))
    args = parser.parse_args(arguments)
    walls = {seed: make_wall(args.out, seed) for seed in args.seeds}
    print(
        "| wall | photos | registered | right | wrong | points | CPU-s | strategy | "
        "pairs, XFeat | pairs, ALIKED |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for seed, wall in walls.items():
        for larger in (False, True):
            label = f"{seed}, with ALIKED" if larger else f"{seed}"
            print(placed_row(label, place(wall.files, larger=larger), wall), flush=True)
    return 0


def placed_row(label: str, placed: Placed, wall: OrdinaryWall) -> str:
    """Return the line of a wall's table."""
    right = len(right_photos(placed.poses, wall.truth))
    cells = [
        label,
        str(len(wall.files)),
        str(len(placed.poses)),
        str(right),
        str(len(placed.poses) - right),
        str(placed.points),
        f"{placed.seconds:.0f}",
        placed.strategy,
        *(pairs_cell(placed.pairs.get(name, ()), wall) for name in ("learned", "larger")),
    ]
    return f"| {' | '.join(cells)} |"


def pairs_cell(pairs: Collection[Pair], wall: OrdinaryWall) -> str:
    """Return how many pairs are verified rightly, and how many falsely; "" without any."""
    rows = {file.name: k for k, file in enumerate(wall.files)}
    either = np.maximum(wall.overlaps, wall.overlaps.T)
    right = sum(either[rows[a], rows[b]] > _MIN_OVERLAP for a, b in pairs)
    return f"{right} + {len(pairs) - right} false" if pairs else ""


if __name__ == "__main__":
    sys.exit(main())
