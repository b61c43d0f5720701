"""How soon a leaderboard and a climber's progress are there, and a tick that changes both.

    python -m gym.benchmarks.boards [--database URL] [--rate 5] [--seconds 40]

5,000 climbers, 1,000,000 ascents in a year on 1,800 routes of six circuits (all made up), put in
past the application and then counted as `walltopo gym recount` does; in SQLite or in an empty
PostgreSQL database, server and phones on this one machine. Half of the climbers are on boards.
Requests come at a fixed rate whether or not the ones before were answered; a time counts from when
the request was due.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from datetime import timedelta
from typing import Any
from uuid import UUID

import httpx
import numpy as np
from gym.benchmarks.load import Draw, Prepare, Request, measure, options
from gym.tests.worlds import Server, make_world
from sqlalchemy import insert, text

from walltopo_gym.accounts.actor import sign_in
from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.climbing.counting import recount_gym
from walltopo_gym.climbing.models import Ascent, Follow
from walltopo_gym.clock import now
from walltopo_gym.gyms.models import GradeSystem, Gym, Membership
from walltopo_gym.publishing.models import Route

CLIMBERS, ASCENTS, ROUTES = 5_000, 1_000_000, 1_800
_VISIT, _FRIENDS, _SIGNED_IN, _BATCH = 5, 20, 200, 50_000
CIRCUITS = [
    {"label": label, "low": low, "high": high}
    for label, low, high in (
        ("Yellow", "3", "4"),
        ("Green", "4", "5"),
        ("Blue", "5", "6A"),
        ("Red", "6A", "6C"),
        ("Black", "6C", "7B"),
        ("White", "7B", "8A"),
    )
]
KINDS = {
    "board of the month": "board",
    "board of the year": "board?period=YEAR",
    "board of a circuit": "board?period=all&circuit=Red",
    "friends' board": "board?period=all&friends=true",
    "board, a late page": "board?period=all&skip=2000",
    "progress": "progress",
    "feed": "feed",
    "tick": "",
}


def fill(server: Server) -> tuple[str, list[str], list[UUID], float]:
    """The gym's path, cookies of some climbers, routes that hang, and seconds of the count."""
    rng = np.random.default_rng(0)
    world = make_world(server, visibility="public")
    people, routes = [_key(rng) for _ in range(CLIMBERS)], [_key(rng) for _ in range(ROUTES)]
    grades = [CIRCUITS[n % len(CIRCUITS)]["label"] for n in range(ROUTES)]
    at = now()
    with server.database.writing() as session:
        session.get_one(Gym, world.gym.id).time_zone = "Europe/Prague"
        system = GradeSystem(gym_id=world.gym.id, name="Ours", kind="circuits", grades=CIRCUITS)
        session.add(system)
        session.flush()
        session.execute(
            insert(Route),
            [
                {
                    "id": route,
                    "wall_id": world.wall.id,
                    "name": f"R{n}",
                    "colour": "red",
                    "grade_system_id": system.id,
                    "grade": grades[n],
                    "setter": "",
                    "tags": [],
                    "set_on": at.date(),
                    "stripped_at": None if n >= ROUTES - 300 else at,
                }
                for n, route in enumerate(routes)
            ],
        )
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
        session.execute(
            insert(Profile),
            [
                {"person_id": person, "on_boards": n % 2 == 0, "show_ascents": "followers"}
                for n, person in enumerate(people)
            ],
        )
        session.execute(
            insert(Follow),
            [
                {
                    "follower_id": people[n],
                    "followed_id": people[(7 * n + 11 * k + 1) % CLIMBERS],
                    "accepted": True,
                }
                for n in range(_SIGNED_IN)
                for k in range(_FRIENDS)
            ],
        )
        cookies = [sign_in(session, person, "phone", 1) for person in people[:_SIGNED_IN]]
    rows = _ascents(rng, world.gym.id, people, routes, grades)
    for _ in range(ASCENTS // _BATCH):
        with server.database.writing() as session:
            session.execute(insert(Ascent), [next(rows) for _ in range(_BATCH)])
    begun = time.perf_counter()
    with server.database.writing() as session:
        session.execute(text("ANALYZE"))
    recount_gym(server.database, world.gym.id)
    return world.path, cookies, routes[-300:], time.perf_counter() - begun


def _key(rng: np.random.Generator) -> UUID:
    return UUID(bytes=rng.bytes(16), version=4)


def _ascents(
    rng: np.random.Generator, gym: UUID, people: list[UUID], routes: list[UUID], grades: list[str]
) -> Iterator[dict[str, Any]]:
    """Visits of five ascents; who comes more often than others does so all year."""
    keen = rng.dirichlet(np.full(CLIMBERS, 2.0))
    at = now()
    for who in rng.choice(CLIMBERS, size=ASCENTS // _VISIT, p=keen).tolist():
        begins = at - timedelta(days=int(rng.integers(1, 365)), minutes=int(rng.integers(600)))
        for n in range(_VISIT):
            which = int(rng.integers(ROUTES))
            yield {
                "id": _key(rng),
                "person_id": people[who],
                "gym_id": gym,
                "gym_name": "Hall",
                "route_id": routes[which],
                "route_name": "R",
                "grade": grades[which],
                "kind": ("flash", "top", "top", "try")[which % 4],
                "tries": 1,
                "climbed_at": begins + timedelta(minutes=12 * n),
            }


def asking(path: str, cookies: list[str], routes: list[UUID]) -> Prepare:
    """Each kind in its turn, of some climber."""
    rng = np.random.default_rng(1)

    def draw(number: int) -> Request:
        kind = list(KINDS)[number % len(KINDS)]
        cookie = cookies[int(rng.integers(len(cookies)))]
        if kind != "tick":
            where = f"{path}/{KINDS[kind].replace('YEAR', f'{now():%Y}')}"
            return Request(kind, where, cookie)
        route = routes[int(rng.integers(len(routes)))]
        body = {"route_id": str(route), "kind": "top", "climbed_at": now().isoformat()}
        return Request(kind, f"{path}/ascents/{_key(rng)}", cookie, "PUT", body=body)

    async def prepare(_: httpx.AsyncClient) -> Draw:
        return draw

    return prepare


def main(arguments: Sequence[str] | None = None) -> int:
    args = options(__doc__, rate=5, seconds=40).parse_args(arguments)
    counted_s: list[float] = []

    def filled(server: Server) -> Prepare:
        path, cookies, routes, seconds = fill(server)
        counted_s.append(seconds)
        return asking(path, cookies, routes)

    measure(filled, args)
    print(f"counted anew: {ASCENTS} ascents of {CLIMBERS} climbers in {counted_s[0]:.0f} s")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
