"""Figures of route clustering.

    python -m benchmarks.routes gym-a       true holds and colours of the rendered gym
    python -m benchmarks.routes gyms        30 generated gyms outside all tuning
    python -m benchmarks.routes masks       the real photos with hand-drawn masks, in the image
    python -m benchmarks.routes dim FOLDER  photos of gyms 4101 to 4108 in dim, mixed light, made there
    python -m benchmarks.routes proxy       path lengths on the proxy against the full mesh
    python -m benchmarks.routes speed       600 holds on a wall of 500,000 triangles

For the other commands an optional last argument is the folder of the test data (default
../shared/data). ARI is the adjusted Rand index over holds that belong to a route; a hold without a
found route counts as a group of its own.
"""

from __future__ import annotations

import colorsys
import json
import sys
import time
from pathlib import Path

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from sklearn.metrics import adjusted_rand_score

from walltopo.core import Mesh
from walltopo.describe.routes.find import find_routes
from walltopo.describe.settings import RoutesSettings
from walltopo.scans.holds import Hold, Role
from walltopo.scans.routes import Route
from walltopo_lab.synth.set_gyms import set_gym

ROLES: dict[int, Role] = {-1: "volume", -2: "downclimb"}


def rand_index(routes: list[Route], truth: dict[int, int]) -> float:
    """Return the ARI of found routes against true ones (hold id to route)."""
    found = {hold: route.id for route in routes for hold in route.holds}
    ids = sorted(truth)
    alone = {hold: -hold for hold in ids}
    return float(
        adjusted_rand_score([truth[k] for k in ids], [found.get(k, alone[k]) for k in ids])
    )


def _point(values: list[float]) -> tuple[float, float, float]:
    return values[0], values[1], values[2]


def true_holds(folder: Path) -> tuple[Mesh, list[Hold], dict[int, int]]:
    """Return mesh, holds with true attributes, and true routes of a rendered scan."""
    source = folder / "lift" / "gt.npz"
    data = np.load(source if source.is_file() else folder / "gt.npz")
    scene = json.loads((folder / "scene.json").read_text(encoding="utf-8"))
    holds, truth = [], {}
    for entry in scene["instances"]:
        role: Role = ROLES.get(entry["route"], "hold")
        holds.append(
            Hold(
                entry["id"],
                entry["class"],
                position=_point(entry["position"]),
                normal=_point(entry["normal"]),
                colour=entry["colour"],
                size=0.15,
                role=role,
            )
        )
        if role == "hold":
            truth[entry["id"]] = entry["route"]
    return Mesh(data["vertices"], data["faces"]), holds, truth


def gym_a(data: Path) -> None:
    """Print the ARI of routes from true holds and colours."""
    for name in ("gym-a", "gym-a-reset"):
        mesh, holds, truth = true_holds(data / name)
        begun = time.process_time()
        routes, _ = find_routes(mesh, holds, RoutesSettings(link="colour"))
        print(
            f"{name}: ARI {rand_index(routes, truth):.4f}, {len(routes)} routes of "
            f"{len(set(truth.values()))}, {len(truth)} holds, "
            f"{time.process_time() - begun:.1f} CPU-s on {len(mesh.faces)} triangles"
        )


def gyms(data: Path) -> None:
    """Print the ARI over 30 generated gyms of the presets easy, modern, oldschool-dark and lead."""
    presets = ("modern", "oldschool-dark", "lead", "modern", "easy")
    values = []
    for number in range(30):
        preset = presets[number % len(presets)]
        gym = set_gym(preset, 1000 + number)
        routes, _ = find_routes(gym.mesh, gym.holds, RoutesSettings(link="colour"))
        values.append(rand_index(routes, gym.route))
        print(
            f"{preset} {1000 + number}: ARI {values[-1]:.4f}, {len(routes)} routes of "
            f"{len(set(gym.route.values()))}, {len(gym.route)} holds"
        )
    print(f"30 generated gyms: mean {np.mean(values):.4f}, worst {np.min(values):.4f}")


def masks(data: Path) -> None:
    """Print the ARI per real photo."""
    from benchmarks.routes_photos import report_masks

    report_masks(data / "hold-masks")


def dim(folder: Path) -> None:
    """Print the ARI per photo of generated gyms in dim, mixed light, outside all tuning."""
    from benchmarks.routes_photos import report_generated

    report_generated(folder, 4101, 8)


def proxy(data: Path) -> None:
    """Print path errors of proxies of several sizes against FlipOut on gym-a/lift's full mesh."""
    from walltopo.describe.routes.geodesic import pair_lengths
    from walltopo.describe.routes.grouping import candidate_pairs
    from walltopo.describe.routes.proxy import PROXY_FACES, build_proxy

    mesh, holds, truth = true_holds(data / "gym-a")
    present = np.unique(np.load(data / "gym-a" / "lift" / "gt.npz")["face_instance"])
    holds = [hold for hold in holds if hold.id in truth and hold.id in present]
    points = np.array([hold.position for hold in holds])
    pairs = candidate_pairs(points, ["any"] * len(holds), 1.0, 2.5)
    pairs = pairs[np.random.default_rng(0).choice(len(pairs), 100, replace=False)]
    begun = time.process_time()
    full = build_proxy(mesh.vertices, mesh.faces, points, len(mesh.faces))
    exact = pair_lengths(full, pairs, 1.0)
    whole = time.process_time() - begun

    def row(name: str, lengths: NDArray[np.float64], share: str) -> None:
        median, high, worst = np.percentile(100 * np.abs(lengths / exact - 1), [50, 95, 100])
        print(f"| {name} | {median:.1f} % | {high:.1f} % | {worst:.1f} % | {share} |", flush=True)

    print("| triangles | median | 95 % | worst | CPU, of the whole mesh's |\n|---|---|---|---|---|")
    for faces in (5_000, PROXY_FACES, 80_000):
        begun = time.process_time()
        small = build_proxy(mesh.vertices, mesh.faces, points, faces)
        lengths = pair_lengths(small, pairs, 1.0)
        default = " (default)" if faces == PROXY_FACES else ""
        row(f"{faces:,}{default}", lengths, f"{100 * (time.process_time() - begun) / whole:.0f} %")
    row("straight lines", np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1), "-")
    print(
        f"\n{len(full.faces):,} triangles of the whole mesh after the repair, "
        f"{len(pairs)} pairs of holds, paths up to {exact.max():.1f} m"
    )


def painted(hold: Hold, number: int) -> Hold:
    """Return the hold in one of ten hues."""
    red, green, blue = (round(255 * v) for v in colorsys.hsv_to_rgb(number / 10, 0.8, 0.8))
    return replace(hold, colour=f"colour {number}", colour_rgb=(red, green, blue))


def speed(data: Path) -> None:
    """Print the time of finding the routes of 600 holds in 10 colours on 500,000 triangles."""
    rng = np.random.default_rng(0)
    columns, rows = 707, 354
    x, z = np.meshgrid(np.linspace(0, 14, columns), np.linspace(0, 5, rows))
    y = 0.25 * np.sin(1.3 * x) - 0.2 * z + rng.normal(0, 0.002, x.shape)
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    over = corner + columns
    faces = np.vstack(
        [
            np.column_stack([corner, corner + 1, over + 1]),
            np.column_stack([corner, over + 1, over]),
        ]
    )
    places = vertices[rng.choice(len(vertices), 600, replace=False)].tolist()
    holds = [
        painted(Hold(k + 1, "hold", position=(p[0], p[1], p[2]), size=0.15), k % 10)
        for k, p in enumerate(places)
    ]
    mesh = Mesh(vertices, faces)
    find_routes(mesh, holds[:40], RoutesSettings())  # load libraries and compile
    for settings, words in (
        (RoutesSettings(), "by paint"),
        (RoutesSettings(link="colour"), "by name"),
    ):
        wall, cpu = time.perf_counter(), time.process_time()
        routes, _ = find_routes(mesh, holds, settings)
        print(
            f"600 holds of 10 colours on {len(faces)} triangles, {words}: {len(routes)} routes, "
            f"{time.process_time() - cpu:.1f} CPU-s, {time.perf_counter() - wall:.1f} s"
        )


def main() -> None:
    functions = (gym_a, gyms, masks, dim, proxy, speed)
    actions = {function.__name__.replace("_", "-"): function for function in functions}
    if len(sys.argv) < 2 or sys.argv[1] not in actions:
        raise SystemExit(__doc__)
    actions[sys.argv[1]](Path(sys.argv[2] if len(sys.argv) > 2 else "../shared/data"))


if __name__ == "__main__":
    main()
