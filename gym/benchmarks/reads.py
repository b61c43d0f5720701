"""How soon a wall's page has its data, while a hall full of phones asks.

    python -m gym.benchmarks.reads [--database URL] [--rate 100] [--seconds 30]

300 routes on ten walls, 4,000 climbers, 50,000 ascents, 20,000 opinions (all made up), in SQLite
or in an empty PostgreSQL database; server and phones on this one machine. Requests come at a fixed
rate whether or not the ones before were answered; a time counts from when the request was due.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from uuid import UUID

import httpx
import numpy as np
from gym.benchmarks.load import Draw, Prepare, Request, measure, options
from gym.tests.worlds import Server, World, hold, make_world
from sqlalchemy import insert, select

from walltopo_gym.accounts.actor import sign_in
from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Membership
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import Wall

WALLS, ROUTES, CLIMBERS, ASCENTS, OPINIONS = 10, 30, 4_000, 50_000, 20_000
_SIGNED_IN = 100
# A phone's requests: a new wall, a wall that it has already, ascents of others, its own ascents.
SHARES = {"wall": 0.4, "wall, unchanged": 0.3, "tallies": 0.2, "own ascents": 0.1}


def fill(server: Server) -> tuple[str, list[UUID], list[str]]:
    """The gym's path, its walls, and cookies of some climbers."""
    world = make_world(server, visibility="public")
    walls = []
    for number in range(WALLS):
        with server.database.writing() as session:
            wall = Wall(gym_id=world.gym.id, name=f"Wall {number}")
            session.add(wall)
        there = World(server, world.gym, wall, world.people)
        holds = [hold(n, 0.1 * n, 1.0) for n in range(1, 8 * ROUTES + 1)]
        routes = {n: range(8 * n - 7, 8 * n + 1) for n in range(1, ROUTES + 1)}
        scan = there.reviewed(routes, holds)
        entries = [{"number": n, "name": f"Route {n}"} for n in routes]
        assert there.publish(scan, *entries).is_success
        walls.append(wall.id)
    return world.path, walls, crowd(server, world)


def crowd(server: Server, world: World) -> list[str]:
    """Climbers, what they did and think; cookies of some."""
    rng = np.random.default_rng(0)

    def key() -> UUID:
        return UUID(bytes=rng.bytes(16), version=4)

    people = [key() for _ in range(CLIMBERS)]
    with server.database.writing() as session:
        session.execute(
            insert(Person),
            [
                {
                    "id": person,
                    "email": f"c{n}@example.com",
                    "name": f"Climber {n}",
                    "password_hash": "!",
                }
                for n, person in enumerate(people)
            ],
        )
        session.execute(
            insert(Membership),
            [{"gym_id": world.gym.id, "person_id": person, "role": "member"} for person in people],
        )
        routes = list(session.scalars(select(Route.id)))
        at = now()
        rows = [
            {
                "id": key(),
                "person_id": people[int(rng.integers(CLIMBERS))],
                "gym_id": world.gym.id,
                "route_id": routes[int(rng.integers(len(routes)))],
                "gym_name": "Hall",
                "route_name": "R",
                "grade": "6A",
                "kind": str(rng.choice(["flash", "top", "try"])),
                "tries": 1,
                "climbed_at": at - timedelta(minutes=n),
            }
            for n in range(ASCENTS)
        ]
        session.execute(insert(Ascent), rows)
        pairs = {
            (int(rng.integers(CLIMBERS)), int(rng.integers(len(routes)))) for _ in range(OPINIONS)
        }
        session.execute(
            insert(Opinion),
            [
                {"person_id": people[who], "route_id": routes[which], "stars": 3, "wish": "keep"}
                for who, which in pairs
            ],
        )
        return [sign_in(session, person, "phone", 1) for person in people[:_SIGNED_IN]]


def asking(path: str, walls: list[UUID], cookies: list[str]) -> Prepare:
    """By `SHARES`; the walls' ETags are read first."""
    rng = np.random.default_rng(1)

    async def prepare(client: httpx.AsyncClient) -> Draw:
        etags = {}
        for wall in walls:
            answer = await client.get(f"{path}/walls/{wall}/published")
            etags[wall] = answer.headers["etag"]

        def draw(_: int) -> Request:
            kind = str(rng.choice(list(SHARES), p=list(SHARES.values())))
            wall = walls[int(rng.integers(len(walls)))]
            cookie = cookies[int(rng.integers(len(cookies)))]
            if kind == "tallies":
                return Request(kind, f"{path}/walls/{wall}/tallies")
            if kind == "own ascents":
                return Request(kind, f"/me/ascents?wall={wall}", cookie)
            known = {"if-none-match": etags[wall]} if kind == "wall, unchanged" else {}
            return Request(kind, f"{path}/walls/{wall}/published", headers=known)

        return draw

    return prepare


def main(arguments: Sequence[str] | None = None) -> int:
    args = options(__doc__, rate=100, seconds=30).parse_args(arguments)
    measure(lambda server: asking(*fill(server)), args)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
