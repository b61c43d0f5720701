"""Figures of the lift: speed, and borders refined on coarse meshes.

    python -m benchmarks.lift speed DATA       # DATA: the folder with gym-a/lift
    python -m benchmarks.lift scaling
    python -m benchmarks.lift coarse           # borders refined on coarse meshes

Times are wall clock of one call on meshes and masks in memory, the best of three after one to
compile. CPU seconds beside them show the load of the machine.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.lift_accuracy import against, load_gym
from benchmarks.lift_scenes import MaskNoise, make_scene, spoil
from walltopo.core import Camera, Instances, Mask, Mesh, View
from walltopo.geometry.rays import Bvh
from walltopo.segment.lift import LiftParams, lift
from walltopo.segment.lift.refine import refine_borders


def timed(run: Callable[[], object], repeats: int = 3) -> tuple[float, float]:
    """Return the best wall and CPU seconds of some calls."""
    best = (np.inf, np.inf)
    for _ in range(repeats):
        wall, cpu = time.perf_counter(), time.process_time()
        run()
        best = min(best, (time.perf_counter() - wall, time.process_time() - cpu))
    return best


def peak_gb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def speed(data: Path) -> None:
    mesh, views, _ = load_gym(data, "noisy")
    print("| gym-a/lift, noisy, 1.33M triangles, 60 views | wall s | CPU s |\n|---|---|---|")
    fast: dict[str, float] = {}
    for method in ("robust", "literal"):
        params = LiftParams(method=method)
        lift(mesh, views, params)
        wall, cpu = timed(lambda p=params: lift(mesh, views, p))  # type: ignore[misc]
        fast[method] = cpu
        print(f"| {method} | {wall:.2f} | {cpu:.2f} |", flush=True)
    from walltopo.geometry.graphs import louvain
    from walltopo.segment.lift.literal import lift_reference

    wall, cpu = timed(lambda: lift_reference(mesh, views, LiftParams(method="literal"), louvain), 1)
    print(f"| reference | {wall:.1f} | {cpu:.1f} |")
    print(f"\nreference / literal in CPU seconds: {cpu / fast['literal']:.0f}")
    print(f"peak memory of the process: {peak_gb():.2f} GB")


def wall_scene(triangles: int, views: int, masks: int, seed: int = 5) -> tuple[Mesh, list[View]]:
    """Return a bumpy wall of about `triangles` triangles, and views with masks of the bumps."""
    rng = np.random.default_rng(seed)
    width, height = 12.0, 4.0
    step = float(np.sqrt(2 * width * height / triangles))
    x, z = np.meshgrid(np.arange(0, width, step), np.arange(0, height, step))
    centres = np.column_stack([rng.uniform(0, width, 260), rng.uniform(0, height, 260)])
    y = np.zeros_like(x)
    for cx, cz in centres:
        near = np.s_[
            max(0, int((cz - 0.3) / step)) : int((cz + 0.3) / step),
            max(0, int((cx - 0.3) / step)) : int((cx + 0.3) / step),
        ]
        bump = -0.1 * np.exp(-((x[near] - cx) ** 2 + (z[near] - cz) ** 2) / 0.005)
        y[near] = np.minimum(y[near], bump)
    grid = np.arange(x.size, dtype=np.int32).reshape(x.shape)
    a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
    c, d = grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    points = np.column_stack([centres[:, 0], np.full(len(centres), -0.03), centres[:, 1]])
    posed = [_wall_view(rng, k, points, masks, width) for k in range(views)]
    return Mesh(np.stack([x, y, z], -1).reshape(-1, 3), faces), posed


def _wall_view(
    rng: np.random.Generator, number: int, points: NDArray[np.float64], masks: int, width: float
) -> View:
    centre = np.array([rng.uniform(0, width), -rng.uniform(2.5, 4.5), rng.uniform(1.2, 2.2)])
    turn = rng.uniform(-0.35, 0.35)
    forward = np.array([np.sin(turn), np.cos(turn), 0.05])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    camera = Camera("PINHOLE", 1280, 960, (947.0, 947.0, 640.0, 480.0))
    view = View(f"{number}.jpg", camera, np.column_stack([rotation, -rotation @ centre]))
    local = view.to_camera(points)
    pixels = view.project(points)
    shown = np.flatnonzero(((pixels > 62) & (pixels < [1218, 898])).all(axis=1))
    rows, cols = np.mgrid[-60:61, -60:61]
    found = []
    for k in shown[:masks]:
        radius = 0.07 * 947.0 / local[k, 2] * rng.uniform(0.9, 1.1)
        x, y = (int(v) - 60 for v in pixels[k])
        found.append(Mask(np.hypot(cols, rows) < min(radius, 59.0), x, y, 1280, 960, 1, 0.9))
    return view.with_masks(tuple(found))


def scaling() -> None:
    mesh, views = wall_scene(1_000_000, 133, 40)
    lift(mesh, views)
    before = peak_gb()
    wall, cpu = timed(lambda: lift(mesh, views))
    masks = sum(len(view.masks) for view in views)
    print(
        f"133 views x {len(mesh.faces)} triangles, {masks} masks: {wall:.2f} s wall, {cpu:.2f} CPU"
    )
    print(
        f"peak memory {peak_gb():.2f} GB (with mesh and masks; {before:.2f} after the first call)"
    )
    print("\n| views | wall s | CPU s | CPU ms a view |\n|---|---|---|---|")
    for count in (30, 60, 120, 240):
        mesh, views = wall_scene(1_000_000, count, 40)
        wall, cpu = timed(lambda m=mesh, v=views: lift(m, v))  # type: ignore[misc]
        print(f"| {count} | {wall:.2f} | {cpu:.2f} | {cpu / count * 1e3:.1f} |", flush=True)
    print("\n| triangles | wall s | CPU s | CPU s a million |\n|---|---|---|---|")
    for count in (250_000, 500_000, 1_000_000, 2_000_000):
        mesh, views = wall_scene(count, 60, 40)
        wall, cpu = timed(lambda m=mesh, v=views: lift(m, v))  # type: ignore[misc]
        print(f"| {count} | {wall:.2f} | {cpu:.2f} | {cpu / count * 1e6:.2f} |", flush=True)


def coarse() -> None:
    """Print APs of refined and unrefined borders on coarse meshes, against the fine truth."""
    scene = make_scene(100)
    views = spoil(scene.views, MaskNoise(), 0)
    # The wall faces -y, and each line along y meets it once. So rays along y map faces to those of
    # the fine mesh.
    origins = scene.mesh.centroids - [0.0, 5.0, 0.0]
    along = np.tile([0.0, 1.0, 0.0], (len(origins), 1))
    print(
        "| edge | levels | triangles | noisy AP / AP50 / AP25 | clean AP |\n|---|---|---|---|---|"
    )
    for step in (0.024, 0.048):
        start = make_scene(100, step=step, views=1).mesh
        for levels in (0, 1, 2):
            texts = []
            for given in (views, list(scene.views)):
                mesh, found = refine_borders(start, given, lift(start, given), levels=levels)
                hit, _ = Bvh(mesh.vertices, mesh.faces).first_hit(origins, along)
                fine = Instances(
                    np.where(hit >= 0, found.face_instance[hit], 0).astype(np.int32),
                    np.zeros(len(hit), dtype=np.float32),
                    found.records,
                )
                a = against(fine, scene.mesh, scene.face_instance, scene.face_views)
                texts.append(f"{a.ap:.3f} / {a.ap50:.3f} / {a.ap25:.3f}")
            clean = texts[1].split()[0]
            edge = f"{1000 * step:.0f} mm"
            print(f"| {edge} | {levels} | {len(mesh.faces):,} | {texts[0]} | {clean} |", flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("what", choices=("speed", "scaling", "coarse"))
    parser.add_argument("data", type=Path, nargs="?", help="folder that holds gym-a")
    args = parser.parse_args(arguments)
    if args.what == "speed" and args.data is None:
        parser.error(f"{args.what} needs the data folder")
    if args.what == "speed":
        speed(args.data)
    elif args.what == "scaling":
        scaling()
    else:
        coarse()


if __name__ == "__main__":
    main()
