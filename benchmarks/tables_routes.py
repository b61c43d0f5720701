"""The table of routes: true holds and colours, by default and tuned on other gyms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.tables_lift import FIRST_SEED, PRESETS, USES
from walltopo.describe.routes.proxy import PROXY_FACES, build_proxy
from walltopo_lab.synth.set_gyms import set_gym
from walltopo_lab.tune.routes_problem import RoutesProblem, RoutesWall, load_routes_wall
from walltopo_lab.tune.study import open_study, results, search
from walltopo_lab.tune.walls import Wall


def _set_wall(preset: str, number: int) -> RoutesWall:
    """Return a generated gym, set but not photographed."""
    gym = set_gym(preset, FIRST_SEED + number)
    holds = [hold for hold in gym.holds if hold.id in gym.route]
    points = np.array([hold.position for hold in holds], dtype=np.float64)
    proxy = build_proxy(gym.mesh.vertices, gym.mesh.faces, points, PROXY_FACES)
    routes = tuple(gym.route[hold.id] for hold in holds)
    colours = tuple(hold.colour for hold in holds)
    return RoutesWall(f"{preset}-{number}", points, colours, routes, proxy)


def routes_table(data: Path, work: Path, gyms: int, trials: int) -> dict[str, Any]:
    """Return the ARI of each wall by default and tuned on the presets' first two gyms."""
    train = RoutesProblem([_set_wall(p, k) for p in PRESETS for k in range(len(USES))])
    study = open_study(train, f"sqlite:///{work / 'tuning.db'}", "routes", 0)
    search(study, train, trials)
    found = results(study, train)
    walls = [load_routes_wall(Wall(name, "test", data / name)) for name in ("gym-a", "gym-a-reset")]
    walls += [_set_wall(p, len(USES) + k) for p in PRESETS for k in range(gyms)]
    judge = RoutesProblem(walls)
    return {
        "default": judge.evaluate(found.default.values),
        "tuned": judge.evaluate(found.best.values),
        "values": found.best.values,
        "trials": len(found.trials),
        "train": [found.default.figure, found.best.figure],
    }
