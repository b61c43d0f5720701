"""ARI of the routes with true holds and colours, by default and tuned on other gyms.

    python -m benchmarks.routes_tuned DATA [--work DIR] [--gyms N] [--trials N]

The walls are `gym-a`, `gym-a-reset` and generated gyms. The search runs on four other generated
gyms.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.lift_tuned import FIRST_SEED, PRESETS, USES
from walltopo.describe.routes.proxy import PROXY_FACES, build_proxy
from walltopo_lab.synth.set_gyms import set_gym
from walltopo_lab.tune.routes_task import RoutesTask, RoutesWall, load_routes_wall
from walltopo_lab.tune.study import open_study, run_trials, study_results
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path)
    parser.add_argument("--work", type=Path, default=Path("build/tables"))
    parser.add_argument("--gyms", type=int, default=3, help="generated gyms of each preset")
    parser.add_argument("--trials", type=int, default=30)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    train = RoutesTask([_set_wall(p, k) for p in PRESETS for k in range(len(USES))])
    study = open_study(train, f"sqlite:///{args.work / 'tuning.db'}", "routes", 0)
    run_trials(study, train, args.trials)
    found = study_results(study, train)
    given = ("gym-a", "gym-a-reset")
    walls = [load_routes_wall(Wall(name, "test", args.data / name)) for name in given]
    walls += [_set_wall(p, len(USES) + k) for p in PRESETS for k in range(args.gyms)]
    judge = RoutesTask(walls)
    default, tuned = judge.evaluate(found.default.values), judge.evaluate(found.best.values)
    print("| wall | ARI, default | tuned |")
    print("|---|---|---|")
    for name, value in default.items():
        print(f"| {name} | {value:.3f} | {tuned[name]:.3f} |")
    values = ", ".join(f"{name} {value:.3g}" for name, value in found.best.values.items())
    print(
        f"\non the other gyms, {len(found.trials)} trials: ARI {found.default.figure:.3f} by default, "
        f"{found.best.figure:.3f} by the best: {values}"
    )


if __name__ == "__main__":
    main()
