"""Scans of one generated hall: costs that grow faster than the number of photos.

    walltopo synth HALL --walls 6 --photos 360 --size 640x480 --plates 3 --seed 3 \\
        --set cell=0.06 --set detail=0.4 --set lamps=3
    python -m benchmarks.hall stages HALL SCANS --photos 72 150 300
    python -m benchmarks.hall pairs HALL SCANS --photos 150 300
    python -m benchmarks.hall sights HALL SCANS --photos 50 100 200 300

A scan of N photos uses the hall's first N, which show its first walls. `stages` makes the scans in
the folder SCANS, each stage in its own process, and resumes. CPU-seconds are those of the stage and
its children including process start; the peak is that of the largest process. `pairs` prints the
share of photo pairs with truly common surface that are chosen for matching. `sights` draws photos
from all triangles that N photos show, and from those that may lie in each.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, View
from walltopo.core.files import read_json, write_json
from walltopo.geometry.zbuffer import faces_in_view, render_culled, render_ids, submesh
from walltopo.pipeline.plan import names_of_plan
from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse.feature_cache import database_of
from walltopo.reconstruct.sparse.jobs import Pairing, photo_ids
from walltopo.reconstruct.sparse.pairs import choose_pairs
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import Photo, PhotoList

Pair = tuple[int, int]

RETRIEVED = (10, 20, 30, 50)
SHARES = (0.3, 0.5)  # share of a photo's visible surface, in a pair that should be matched
LOOK = (48, 36)  # rays of a photo
DRAWN = 20  # photos to draw, evenly spread
CELL = 0.25  # m, side of the cubes in which shared surface is counted


def first_photos(hall: Path, count: int) -> list[Path]:
    """Return the first photos of a hall.

    Raises
    ------
    InputError : the hall has fewer.
    """
    photos = sorted((hall / "photos").glob("*.jpg"))
    if len(photos) < count:
        raise InputError(f"{hall}: {count} photos were asked for, it has {len(photos)}")
    return photos[:count]


def run_stages(hall: Path, place: Path, count: int) -> dict[str, dict[str, float]]:
    """Return CPU-seconds and GiB of each stage of a scan; measured stages are not run again."""
    file = place / "stages.json"
    figures: dict[str, dict[str, float]] = read_json(file) if file.is_file() else {}
    photos = place / "photos"
    photos.mkdir(parents=True, exist_ok=True)
    for photo in first_photos(hall, count):
        if not (photos / photo.name).exists():
            (photos / photo.name).symlink_to(photo.absolute())
    for stage in names_of_plan(part=False):
        if stage in figures:
            continue
        command = [sys.executable, "-m", "walltopo", "scan", str(photos), "-q"]
        command += ["-o", str(place / "scan"), "--to", stage]
        child = os.posix_spawn(sys.executable, command, os.environ)
        _, status, usage = os.wait4(child, 0)
        if status:
            raise SystemExit(f"{count} photos: stage {stage} failed")
        figures[stage] = {
            "cpu": usage.ru_utime + usage.ru_stime,
            "gib": usage.ru_maxrss / 2**20,
        }
        write_json(file, figures)
    return figures


def exponent(counts: Sequence[int], values: Sequence[float]) -> float:
    """Return e of the best fit of c * count ** e; NaN for a single count."""
    if len(counts) < 2:
        return float("nan")
    return float(np.polyfit(np.log(counts), np.log(np.maximum(values, 1e-9)), 1)[0])


def show_stages(measured: Mapping[int, Mapping[str, Mapping[str, float]]]) -> None:
    """Print two tables: CPU-seconds and memory of each stage at each number of photos."""
    counts = sorted(measured)
    for key, title in (("cpu", "CPU-s"), ("gib", "peak GiB")):
        print(f"\n| {title} | {' | '.join(f'{n} photos' for n in counts)} | exponent |")
        print("|---" * (len(counts) + 2) + "|")
        rows = {s: [measured[n][s][key] for n in counts] for s in names_of_plan(part=False)}
        merged = sum if key == "cpu" else max
        rows["all"] = [merged(row) for row in zip(*rows.values(), strict=True)]
        for name, values in rows.items():
            cells = [f"{value:.1f}" for value in values]
            print(f"| {name} | {' | '.join(cells)} | {exponent(counts, values):.2f} |")


def overlaps(hall: Path, views: Sequence[View]) -> NDArray[np.float64]:
    """Return (n, n) share of the smaller view's surface cubes that the other sees too, by truth."""
    from scipy.sparse import csr_array

    from walltopo_lab.synth.shade import distorted_rays
    from walltopo_lab.synth.tracer import Tracer

    truth = np.load(hall / "truth" / "gt.npz")
    tracer = Tracer(truth["vertices"].astype(np.float64), truth["faces"])
    cubes, owner = [], []
    for k, view in enumerate(views):
        camera = view.camera.scaled(LOOK[0] / view.camera.width)
        rotation = np.ascontiguousarray(view.cam_from_world[:, :3])
        way = distorted_rays(
            0,
            camera.height,
            camera.width,
            1,
            camera.fx,
            camera.cx,
            camera.cy,
            camera.distortion[0],
            rotation,
        )
        start = np.tile(view.centre.astype(np.float32), (len(way), 1))
        far = tracer.distances(start, way)
        points = start[far < 50] + way[far < 50] * far[far < 50, None]
        own = np.unique(np.floor(points / CELL).astype(np.int64), axis=0)
        cubes.append(own)
        owner.append(np.full(len(own), k))
    _, number = np.unique(np.concatenate(cubes), axis=0, return_inverse=True)
    ones = np.ones(len(number))
    seen = csr_array((ones, (np.concatenate(owner), number.ravel())))
    common = (seen @ seen.T).toarray()
    sizes = np.diag(common)
    return common / np.maximum(np.minimum(sizes[:, None], sizes[None]), 1)


def show_pairs(hall: Path, scan: ScanFolder, views: Sequence[View]) -> None:
    """Print the share of chosen pairs among those with common surface, and among matches."""
    from walltopo.geometry.colmap import pycolmap

    shared = overlaps(hall, views)
    ids = photo_ids(scan_photos(scan))
    names = {f"{name}": k for k, name in enumerate(view.name for view in views)}
    order = [names[photo.name] for photo in scan_photos(scan)]
    shared = shared[np.ix_(order, order)]
    true = {share: _above(shared, share) for share in SHARES}
    every = len(ids) * (len(ids) - 1) // 2
    with tempfile.TemporaryDirectory() as work:
        copy = shutil.copy(database_of(scan.work), work)
        with pycolmap.Database.open(copy) as database:
            matched = _matched(database) if len(ids) <= SparseSettings().exhaustive_max else None
            for retrieved in RETRIEVED:
                pairing = Pairing(ids, (), 1, SparseSettings().sequential, retrieved, 0)
                chosen = choose_pairs(database, pairing, 0)
                cells = [f"{len(chosen)} of {every}"]
                cells += [f"{len(chosen & true[s]) / len(true[s]):.3f}" for s in SHARES]
                found = "" if matched is None else f"{len(chosen & matched) / len(matched):.3f}"
                print(f"| {len(ids)} | {retrieved} | {' | '.join(cells)} | {found} |", flush=True)


def scan_photos(scan: ScanFolder) -> tuple[Photo, ...]:
    return tuple(sorted(PhotoList.load(scan.photo_list).photos, key=lambda photo: photo.name))


def _above(shared: NDArray[np.float64], share: float) -> set[Pair]:
    a, b = np.nonzero(np.triu(shared >= share, 1))
    return set(zip((a + 1).tolist(), (b + 1).tolist(), strict=True))


def _matched(database: Any) -> set[Pair]:
    """Return pairs of image ids with verified matches."""
    from walltopo.geometry.colmap import pycolmap

    rows = zip(*database.read_two_view_geometry_num_inliers(), strict=True)
    return {pycolmap.pair_id_to_image_pair(pair) for pair, count in rows if count}


def show_sights(hall: Path, views: Mapping[int, Sequence[View]]) -> None:
    """Print the CPU-seconds of drawing a photo, at each number of photos."""
    truth = np.load(hall / "truth" / "gt.npz")
    whole = Mesh(truth["vertices"].astype(np.float64), truth["faces"])
    rows: list[tuple[int, int, float, float]] = []
    for count, own in views.items():
        shown = np.unique(np.concatenate([_before(whole, view) for view in own]))
        mesh = Mesh(*submesh(whole, shown))
        some = own[:: max(1, count // DRAWN)][:DRAWN]
        render_culled(mesh, some[0].camera, some[0].cam_from_world)  # build the index and compile
        start = time.process_time()
        for view in some:
            render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
        middle = time.process_time()
        for view in some:
            render_culled(mesh, view.camera, view.cam_from_world)
        end = time.process_time()
        rows.append((count, len(shown), (middle - start) / len(some), (end - middle) / len(some)))
    print("| photos | triangles | all drawn, CPU-s a photo | those before it | ratio |")
    print("|---|---|---|---|---|")
    for count, faces, all_drawn, part in rows:
        cells = [
            f"{count}",
            f"{faces}",
            f"{all_drawn:.3f}",
            f"{part:.3f}",
            f"{all_drawn / part:.1f}",
        ]
        print(f"| {' | '.join(cells)} |")
    counts, _, all_drawn_each, part_each = zip(*rows, strict=True)
    growth = [f"{exponent(counts, each):.2f}" for each in (all_drawn_each, part_each)]
    print(f"| exponent of the time a photo | | {growth[0]} | {growth[1]} | |")


def _before(mesh: Mesh, view: View) -> NDArray[np.int64]:
    return faces_in_view(mesh, view.camera, view.cam_from_world)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("stages", "pairs", "sights"))
    parser.add_argument("hall", type=Path, metavar="HALL")
    parser.add_argument("scans", type=Path, metavar="SCANS")
    parser.add_argument("--photos", type=int, nargs="+", default=[72, 150, 300], metavar="N")
    args = parser.parse_args()
    places = {count: args.scans / str(count) for count in sorted(args.photos)}
    if args.what == "stages":
        show_stages({n: run_stages(args.hall, place, n) for n, place in places.items()})
        return 0
    views = {view.name: view for view in read_views(args.hall / "truth" / "cameras")}
    if args.what == "sights":
        own_views = {n: [views[p.name] for p in first_photos(args.hall, n)] for n in places}
        show_sights(args.hall, own_views)
        return 0
    shares = " | ".join(f"found of those that share {share:.0%}" for share in SHARES)
    print(
        f"| photos | retrieved | pairs | {shares} | of those that match |\n|---|---|---|---|---|---|"
    )
    for count, place in places.items():
        own = [views[path.name] for path in first_photos(args.hall, count)]
        show_pairs(args.hall, ScanFolder(place / "scan"), own)
    return 0


if __name__ == "__main__":
    sys.exit(main())
