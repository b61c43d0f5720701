"""How soon boards, problems and lists are there in one database that has very many of each.

    python -m gym.benchmarks.makers [--database URL] [--rate 5] [--seconds 60]

1,000,000 ascents of `gym.benchmarks.boards`, 100,000 problems of `gym.benchmarks.problems`, and
20,000 lists of ten routes, one in ten shown to the gym, each with three people who joined it (all
made up); in SQLite or in an empty PostgreSQL database, server and phones on this one machine.
Requests come at a fixed rate, and a time counts from when one was due.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from uuid import UUID

import httpx
import numpy as np
from gym.benchmarks import boards, problems
from gym.benchmarks.load import Draw, Prepare, Request, measure, options
from gym.tests.worlds import Server
from sqlalchemy import insert, select

from walltopo_gym.accounts.actor import sign_in
from walltopo_gym.climbing.sharing import Share
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.lists.models import ClimbList, ListMember

LISTS: Final = 20_000
_ITEMS, _JOINED, _BATCH, _AUTHORS = 10, 3, 5_000, 200
KINDS: Final = ("lists", "a list", "a list's progress", "a list changed")


def fill(server: Server) -> Prepare:
    """Fill a database; return what asks for boards, problems and lists in turn."""
    path, cookies, routes, _ = boards.fill(server)
    prepares = [
        boards.asking(path, cookies, routes),
        _fill_lists(server, path, routes),
        problems.fill(server),
    ]

    async def prepare(client: httpx.AsyncClient) -> Draw:
        draws = [await one(client) for one in prepares]

        def draw(number: int) -> Request:
            turn, of = divmod(number, len(draws))
            return draws[of](turn)

        return draw

    return prepare


def _fill_lists(server: Server, path: str, routes: list[UUID]) -> Prepare:
    """Add lists to a gym; return what asks for them. Authors of those shown are signed in."""
    rng = np.random.default_rng(2)
    keys = [UUID(bytes=rng.bytes(16), version=4) for _ in range(LISTS)]
    with server.database.writing() as session:
        gym = session.scalars(select(Gym).where(Gym.slug == path.rpartition("/")[2])).one()
        of = Membership.gym_id == gym.id, Membership.role == "member"
        people = list(session.scalars(select(Membership.person_id).where(*of)))
        cookies = [sign_in(session, person, "phone", 1) for person in people[:_AUTHORS]]
    for begin in range(0, LISTS, _BATCH):
        part = range(begin, begin + _BATCH)
        with server.database.writing() as session:
            session.execute(
                insert(ClimbList), [_list(rng, gym, people, routes, keys[n], n) for n in part]
            )
            session.execute(
                insert(ListMember),
                [
                    {"list_id": keys[n], "person_id": people[(n + k) % len(people)]}
                    | {"shows_progress": True}
                    for n in part
                    for k in range(1, _JOINED + 1)
                ],
            )
    return _asking(path, cookies, keys[::10], routes)


def _list(
    rng: np.random.Generator, gym: Gym, people: list[UUID], routes: list[UUID], key: UUID, n: int
) -> dict[str, object]:
    chosen = rng.choice(len(routes), _ITEMS, replace=False)
    return {
        "id": key,
        "gym_id": gym.id,
        "person_id": people[n % len(people) if n % 10 else n // 10 % _AUTHORS],
        "name": f"List {n}",
        "note": "",
        "share": Share.GYM.value if n % 10 == 0 else Share.PRIVATE.value,
        "circuit": n % 100 == 0,
        "items": [str(routes[number]) for number in chosen],
        "edits": {},
    }


def _asking(path: str, cookies: list[str], shown: list[UUID], routes: list[UUID]) -> Prepare:
    rng = np.random.default_rng(3)

    def draw(number: int) -> Request:
        kind = KINDS[number % len(KINDS)]
        which = int(rng.integers(len(shown)))
        cookie, one = cookies[which % _AUTHORS], f"{path}/lists/{shown[which]}"
        if kind == "a list changed":
            new = UUID(bytes=rng.bytes(16), version=4)
            body = {"name": "Project", "items": [str(route) for route in routes[:_ITEMS]]}
            return Request(kind, f"{path}/lists/{new}", cookie, "PUT", body=body)
        where = {"lists": f"{path}/lists", "a list": one, "a list's progress": f"{one}/progress"}
        return Request(kind, where[kind], cookie)

    async def prepare(_: httpx.AsyncClient) -> Draw:
        return draw

    return prepare


def main(arguments: Sequence[str] | None = None) -> int:
    args = options(__doc__, rate=5, seconds=60).parse_args(arguments)
    measure(fill, args)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
