"""Routes that climb alike are found, and routes without known moves are left out."""

from __future__ import annotations

import math
from uuid import UUID

import numpy as np
from gym.tests.worlds import Server, hold, make_world
from sqlalchemy import update

from walltopo_gym.publishing.models import Placement
from walltopo_gym.publishing.similar import distances

Features = list[float | None]
STEEP: Features = [40.0, 9.0, None]
STEEPER: Features = [45.0, 9.0, 0.5]
SLAB: Features = [-5.0, 4.0, 0.9]


def test_a_distance_is_in_units_of_the_spread_of_each_feature() -> None:
    near, far = distances(STEEP, [STEEPER, SLAB])
    assert near < far
    scaled = [[a * 1000, b / 7, c] for a, b, c in ([40, 9, 0.5], [45, 9, 0.5], [-5, 4, 0.9])]
    plain = distances([40.0, 9.0, 0.5], [STEEPER, SLAB])
    assert np.allclose(distances(scaled[0], scaled[1:]), plain)


def test_unknown_and_constant_features_do_not_count() -> None:
    assert distances([1.0, None], [[None, 2.0]]).tolist() == [math.inf]
    assert distances([1.0, 5.0], [[1.0, 5.0], [3.0, 5.0]]).tolist()[0] == 0.0
    assert np.isfinite(distances([1.0, 5.0], [[1.0, 5.0], [3.0, 5.0]])).all()


def test_the_most_similar_routes_come_first_and_a_stripped_one_has_some(server: Server) -> None:
    world = make_world(server)
    scan = world.reviewed(
        {n: [n] for n in range(1, 5)}, [hold(n, 0.5 * n, 1.0) for n in range(1, 5)]
    )
    assert world.publish(scan, *({"number": n} for n in range(1, 5))).is_success
    member, setter = world.people["member"], world.people["setter"]
    rows = world.server.ask("GET", f"{world.path}/routes", member).json()
    routes = {row["number"]: row["id"] for row in rows}
    path = f"{world.path}/routes/{routes[1]}"
    assert world.server.ask("GET", f"{path}/similar", member).json() == {"routes": []}
    with server.database.writing() as session:
        for number, features in {1: STEEP, 2: SLAB, 3: STEEPER}.items():
            placed = update(Placement).where(Placement.route_id == UUID(routes[number]))
            session.execute(placed.values(features=features))
    expected = {"routes": [routes[3], routes[2]]}
    assert world.server.ask("GET", f"{path}/similar", member).json() == expected
    assert world.server.ask("POST", f"{path}/strip", setter).is_success
    assert world.server.ask("GET", f"{path}/similar", member).json() == expected
    others = world.server.ask("GET", f"{world.path}/routes/{routes[2]}/similar", member).json()
    assert others == {"routes": [routes[3]]}
