"""Routes of one colour side by side: are they told apart better where makers are known?

    python -m walltopo_lab.benchmarks.routes_makers choose     on gyms 3000 to 3019
    python -m walltopo_lab.benchmarks.routes_makers report     on gyms 1000 to 1019

Gyms of the generator, set but not photographed; two neighbouring routes always share a colour,
which no setter would do, to see what helps. Each route comes from one of four makers (with one
hold in eight from another), and a classifier names the maker of nine holds in ten rightly.
Printed: mean and worst adjusted Rand index for several values of `routes.maker_weight`; 0 is
distance alone.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from walltopo.routes.contract import RoutesSettings
from walltopo.routes.stage import find_routes
from walltopo_lab.benchmarks.routes import rand_index
from walltopo_lab.benchmarks.routes_gyms import SetGym, set_gym

MAKERS = ("Acme", "Bolt", "Crag", "Dyno")
OTHER_SET, MISREAD = 0.125, 0.1
WEIGHTS = (0.0, 0.25, 0.5, 0.75, 0.9)


def paired(seed: int) -> SetGym:
    """A gym whose routes 0 and 1, 2 and 3, ... share a colour, with makers."""
    gym = set_gym(("modern", "oldschool-dark", "easy")[seed % 3], seed)
    rng = np.random.default_rng([19, seed])
    routes = sorted(set(gym.route.values()))
    maker = {route: str(rng.choice(MAKERS)) for route in routes}
    holds = []
    for hold in gym.holds:
        route = gym.route.get(hold.id)
        if route is not None:
            own = maker[route] if rng.random() > OTHER_SET else str(rng.choice(MAKERS))
            read = own if rng.random() > MISREAD else str(rng.choice(MAKERS))
            hold = replace(hold, colour=f"pair {routes.index(route) // 2}", maker=read)
        holds.append(hold)
    return replace(gym, holds=holds)


def main() -> None:
    if sys.argv[1:] not in (["choose"], ["report"]):
        raise SystemExit(__doc__)
    first = 3000 if sys.argv[1] == "choose" else 1000
    gyms = [paired(first + number) for number in range(20)]
    for weight in WEIGHTS:
        settings = RoutesSettings(maker_weight=weight)
        values = [
            rand_index(find_routes(gym.mesh, gym.holds, settings)[0], gym.route) for gym in gyms
        ]
        print(f"maker_weight {weight}: ARI mean {np.mean(values):.3f}, worst {np.min(values):.3f}")


if __name__ == "__main__":
    main()
