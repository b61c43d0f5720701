"""How soon a page of climbers' problems is there on a wall that has very many.

    python -m gym.benchmarks.problems [--database URL] [--rate 5] [--seconds 40]

100,000 problems of 5,000 climbers on one wall of 400 holds, one in ten for its maker alone, with
300,000 ascents (all made up); in SQLite or in an empty PostgreSQL database, server and phones on
this one machine. The wall was scanned anew since half of the problems were made: their holds are
found again by position. Requests come at a fixed rate, and a time counts from when one was due.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from typing import Any
from uuid import UUID

import httpx
import numpy as np
from gym.benchmarks.load import Draw, Prepare, Request, measure, options
from gym.tests.worlds import Server, hold, make_world
from sqlalchemy import insert

from walltopo.scans.holds import Hold
from walltopo_gym.accounts.access import COOKIE
from walltopo_gym.accounts.actor import sign_in
from walltopo_gym.accounts.models import Person
from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Membership
from walltopo_gym.problems.models import Problem, ProblemAscent

CLIMBERS, PROBLEMS, ASCENTS, HOLDS = 5_000, 100_000, 300_000, 400
_SIGNED_IN, _BATCH, _USED, _LATE_PAGES = 200, 10_000, 9, 20
KINDS = ("first page", "a late page", "one's own", "one problem", "climbed it")


def _key(rng: np.random.Generator) -> UUID:
    return UUID(bytes=rng.bytes(16), version=4)


def _holds(first: int) -> list[Hold]:
    return [hold(first + n, 0.5 * (n % 20), 0.3 + 0.2 * (n // 20)) for n in range(HOLDS)]


def fill(server: Server) -> Prepare:
    """Fill a gym; return what asks for its problems."""
    rng = np.random.default_rng(4)  # other keys than `gym.benchmarks.boards` in one database
    world = make_world(server, visibility="public")
    scans = []
    for number, first in enumerate((1, 1001)):
        scan = world.reviewed({1: [first]}, _holds(first))
        assert world.publish(scan, {"number": 1}, revision=number).is_success
        scans.append((scan, first))
    people = [_key(rng) for _ in range(CLIMBERS)]
    with server.database.writing() as session:
        session.execute(
            insert(Person),
            [
                {
                    "id": person,
                    "email": f"maker{n}@example.com",
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
        cookies = [sign_in(session, person, "phone", 1) for person in people[:_SIGNED_IN]]
    keys = [_key(rng) for _ in range(PROBLEMS)]
    for begin in range(0, PROBLEMS, _BATCH):
        rows = [
            _problem(rng, world.wall.id, *scans[n % 2], people, n) | {"id": keys[n]}
            for n in range(begin, begin + _BATCH)
        ]
        with server.database.writing() as session:
            session.execute(insert(Problem), rows)
    pairs = {(int(rng.integers(PROBLEMS)), int(rng.integers(CLIMBERS))) for _ in range(ASCENTS)}
    with server.database.writing() as session:
        session.execute(
            insert(ProblemAscent),
            [
                {
                    "problem_id": keys[problem],
                    "person_id": people[person],
                    "climbed_at": now(),
                    "edits": {},
                }
                for problem, person in sorted(pairs)
            ],
        )
    public = [key for n, key in enumerate(keys) if n % 10]
    return _asking(world.path, str(world.wall.id), cookies, public)


def _problem(
    rng: np.random.Generator, wall: UUID, scan: UUID, first: int, people: list[UUID], n: int
) -> dict[str, Any]:
    used = rng.choice(HOLDS, _USED, replace=False) + first
    uses = ["start", *["hand"] * (_USED - 2), "top"]
    return {
        "wall_id": wall,
        "scan_id": scan,
        "person_id": people[int(rng.integers(CLIMBERS))],
        "name": f"Problem {n}",
        "share": "gym" if n % 10 else "private",
        "matching": True,
        "holds": [{"hold": one, "use": use} for one, use in zip(used.tolist(), uses, strict=True)],
        "edits": {},
        "created_at": now() - timedelta(minutes=PROBLEMS - n),
    }


def _asking(path: str, wall: str, cookies: list[str], public: list[UUID]) -> Prepare:
    rng = np.random.default_rng(1)
    listed = f"{path}/walls/{wall}/problems"

    async def prepare(client: httpx.AsyncClient) -> Draw:
        cursor = ""
        for _ in range(_LATE_PAGES):
            where = listed + (f"?cursor={cursor}" if cursor else "")
            page = await client.get(where, headers={"cookie": f"{COOKIE}={cookies[0]}"})
            cursor = page.raise_for_status().json()["next"]

        def draw(number: int) -> Request:
            kind = KINDS[number % len(KINDS)]
            cookie = cookies[int(rng.integers(len(cookies)))]
            one = f"{path}/problems/{public[int(rng.integers(len(public)))]}"
            if kind == "climbed it":
                words = {"climbed_at": now().isoformat()}
                return Request(kind, f"{one}/climbed", cookie, "PUT", body=words)
            where = {
                "first page": listed,
                "a late page": f"{listed}?cursor={cursor}",
                "one's own": f"{listed}?mine=true",
                "one problem": one,
            }[kind]
            return Request(kind, where, cookie)

        return draw

    return prepare


def main(arguments: Sequence[str] | None = None) -> int:
    args = options(__doc__, rate=5, seconds=40).parse_args(arguments)
    measure(fill, args)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
