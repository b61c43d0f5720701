"""How soon a wall's page has its data, while a hall full of phones asks.

    python -m gym.benchmarks.reads [--database URL] [--rate 100] [--seconds 30]

300 routes on ten walls, 4,000 climbers, 50,000 ascents, 20,000 opinions (all made up), in SQLite
or in an empty PostgreSQL database; server and phones on this one machine. Requests come at a fixed
rate whether or not the ones before were answered; a time counts from when the request was due.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Coroutine, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any
from uuid import UUID

import httpx
import numpy as np
from gym.benchmarks.pacing import paced
from gym.tests.running import Process
from gym.tests.worlds import Server, World, hold, make_world
from sqlalchemy import insert, select, text

from walltopo_gym.accounts.actor import sign_in
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.app import PREFIX
from walltopo_gym.api.rules import COOKIE
from walltopo_gym.climbing.models import Ascent, Opinion
from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Membership, Wall
from walltopo_gym.publishing.models import Route

WALLS, ROUTES, CLIMBERS, ASCENTS, OPINIONS = 10, 30, 4_000, 50_000, 20_000
_SIGNED_IN = 100
# What a phone asks: the wall anew, the wall that it has already, what others climbed, what it did.
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
        session.execute(insert(Person), [
            {"id": person, "email": f"c{n}@example.com", "name": f"Climber {n}",
             "password_hash": "!"} for n, person in enumerate(people)])  # fmt: skip
        session.execute(insert(Membership), [
            {"gym_id": world.gym.id, "person_id": person, "role": "member"}
            for person in people])  # fmt: skip
        routes = list(session.scalars(select(Route.id)))
        at = now()
        rows = [
            {"id": key(), "person_id": people[int(rng.integers(CLIMBERS))], "gym_id": world.gym.id,
             "route_id": routes[int(rng.integers(len(routes)))], "gym_name": "Hall",
             "route_name": "R", "grade": "6A", "kind": str(rng.choice(["flash", "top", "try"])),
             "tries": 1, "climbed_at": at - timedelta(minutes=n)} for n in range(ASCENTS)
        ]  # fmt: skip
        session.execute(insert(Ascent), rows)
        pairs = {(int(rng.integers(CLIMBERS)), int(rng.integers(len(routes))))
                 for _ in range(OPINIONS)}  # fmt: skip
        session.execute(insert(Opinion), [
            {"person_id": people[who], "route_id": routes[which], "stars": 3, "wish": "keep"}
            for who, which in pairs])  # fmt: skip
        return [sign_in(session, person, "phone", 1) for person in people[:_SIGNED_IN]]


async def ask(
    address: str, path: str, walls: list[UUID], cookies: list[str], rate: float, seconds: float
) -> tuple[dict[str, list[float]], Counter[int]]:
    """Milliseconds of each kind of request, and statuses."""
    rng = np.random.default_rng(1)
    times: dict[str, list[float]] = defaultdict(list)
    statuses: Counter[int] = Counter()
    limits = httpx.Limits(max_connections=200, max_keepalive_connections=50)
    async with httpx.AsyncClient(base_url=address + PREFIX, limits=limits, timeout=30) as client:
        etags = {}
        for wall in walls:
            answer = await client.get(f"{path}/walls/{wall}/published")
            etags[wall] = answer.headers["etag"]

        async def one(due: float, kind: str, wall: UUID, cookie: str) -> None:
            where, headers = f"{path}/walls/{wall}/published", {}
            if kind == "wall, unchanged":
                headers = {"if-none-match": etags[wall]}
            elif kind == "tallies":
                where = f"{path}/walls/{wall}/tallies"
            elif kind == "own ascents":
                where, headers = f"/me/ascents?wall={wall}", {"cookie": f"{COOKIE}={cookie}"}
            try:
                statuses[(await client.get(where, headers=headers)).status_code] += 1
            except httpx.HTTPError:
                statuses[0] += 1
            times[kind].append(1000 * (time.perf_counter() - due))

        def drawn(_: int, due: float) -> Coroutine[None, None, None]:
            kind = str(rng.choice(list(SHARES), p=list(SHARES.values())))
            wall = walls[int(rng.integers(len(walls)))]
            cookie = cookies[int(rng.integers(len(cookies)))]
            return one(due, kind, wall, cookie)

        await paced(rate, seconds, drawn)
    return times, statuses


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--database", default="", help="of an empty PostgreSQL database")
    parser.add_argument("--rate", type=float, default=100.0, help="requests a second")
    parser.add_argument("--seconds", type=float, default=30.0)
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        server = Server(data, args.database)
        path, walls, cookies = fill(server)
        with server.database.writing() as session:
            session.execute(text("ANALYZE"))  # as the database does by itself in time
        server.close()
        settings = {"workers": "0", "requests_per_minute": "0"}
        settings |= {"database": args.database} if args.database else {}
        process = Process(data, "serve", "--port", "0", **settings)
        try:
            asyncio.run(ask(process.said, path, walls, cookies, args.rate, 3))  # warm
            before = cpu_s(process.pid)
            times, statuses = asyncio.run(
                ask(process.said, path, walls, cookies, args.rate, args.seconds)
            )
            spent = cpu_s(process.pid) - before
        finally:
            process.stop()
    report(times, statuses, args)
    print(f"processor time of the server: {1000 * spent / sum(statuses.values()):.1f} ms a request")
    return 0


def cpu_s(pid: int) -> float:
    """Processor time of a process so far, all of its threads (proc(5))."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def report(times: dict[str, list[float]], statuses: Counter[int], args: Any) -> None:
    """A line each kind, and all together."""
    kind = "PostgreSQL" if args.database else "SQLite"
    print(f"{kind}, {args.rate:.0f} requests a second for {args.seconds:.0f} s, "
          f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")  # fmt: skip
    print(f"{'':<16} {'p50':>7} {'p95':>7} {'p99':>7} ms")
    whole = [value for values in times.values() for value in values]
    for name, values in [*sorted(times.items()), ("all", whole)]:
        p50, p95, p99 = np.percentile(values, [50, 95, 99])
        print(f"{name:<16} {p50:7.1f} {p95:7.1f} {p99:7.1f}")
    bad = sum(number for status, number in statuses.items() if status not in (200, 304))
    print(f"requests: {sum(statuses.values())}, errors: {bad}")


if __name__ == "__main__":
    raise SystemExit(main())
