"""How far the board of a competition is behind, while forty judges enter what three hundred climb.

    python -m gym.benchmarks.competition [--database URL] [--rate 60] [--seconds 600]
                                         [--listeners 20]

A festival with points that are shared (the costliest rules: a top changes what it is worth to all
who have it), 300 competitors in three categories, 40 problems, all made up; in SQLite or in an
empty PostgreSQL database, server and phones on this one machine. Judges enter at a fixed rate
whether or not the events before were answered; one event in twenty takes another back, one in
fifty is sent twice. An event counts as accepted when its judge has the answer; the board is behind
until a listener has a line that is of this event or a later one. In the end all events are read
back, and the ranks are compared with those of the tests' slow scorer.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import httpx
import numpy as np
from gym.benchmarks.load import cpu_s
from gym.benchmarks.pacing import paced
from gym.tests.competitions.reference import Reference
from gym.tests.running import Process
from gym.tests.worlds import Server, make_world
from sqlalchemy import select, update

from walltopo.core.parallel import available_cores
from walltopo_gym.accounts.access import COOKIE
from walltopo_gym.accounts.actor import sign_in
from walltopo_gym.accounts.models import Person
from walltopo_gym.clock import now
from walltopo_gym.competitions.ledger import Fact
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Problem,
    Round,
    ScoreEvent,
)
from walltopo_gym.competitions.sheet import load_sheet
from walltopo_gym.database.engine import Database
from walltopo_gym.gyms.models import Membership
from walltopo_gym.server.app import PREFIX

CATEGORIES, COMPETITORS, PROBLEMS, JUDGES = 3, 300, 40, 40


@dataclass
class Cup:
    """The competition, and what the phones know of it."""

    id: UUID
    path: str
    entries: list[UUID]
    problems: list[UUID]
    cookies: list[str]


@dataclass
class Screen:
    """A phone or screen that shows the board: when it heard which number, and what it shows."""

    heard: list[tuple[float, int]] = field(default_factory=list)
    lines: dict[str, Any] = field(default_factory=dict)


@dataclass
class Seen:
    """The results of the load; moments by the phones' one clock."""

    answered: dict[int, float] = field(default_factory=dict)  # by the event's number
    accepted: set[str] = field(default_factory=set)
    waited: list[float] = field(default_factory=list)
    statuses: Counter[int] = field(default_factory=Counter)
    screens: list[Screen] = field(default_factory=list)


def fill(server: Server) -> Cup:
    """The competition, running, and judges who are signed in."""
    world = make_world(server, visibility="public")
    row = Competition(
        id=uuid4(), gym_id=world.gym.id, name="Cup", format="festival", state="running"
    )
    one = Round(
        id=uuid4(),
        competition_id=row.id,
        place=0,
        name="Session",
        kind="open",
        scoring={"rules": "shared", "zone": 200, "best": 10},
        state="running",
        begun_at=now(),
    )
    categories = [
        Category(id=uuid4(), competition_id=row.id, place=n, name=f"Category {n}")
        for n in range(CATEGORIES)
    ]
    problems = [
        Problem(id=uuid4(), round_id=one.id, place=n, name=f"Problem {n}", category_ids=[])
        for n in range(PROBLEMS)
    ]
    entries = [
        Entry(
            id=uuid4(),
            competition_id=row.id,
            category_id=categories[n % CATEGORIES].id,
            bib=n + 1,
            name=f"Climber {n}",
        )
        for n in range(COMPETITORS)
    ]
    judges = [
        Person(id=uuid4(), email=f"judge{n}@example.com", name=f"Judge {n}", password_hash="!")
        for n in range(JUDGES)
    ]
    with server.database.writing() as session:
        for rows in ([row, *judges], [one, *categories], [*problems, *entries]):
            session.add_all(rows)
            session.flush()
        session.add_all(
            Membership(gym_id=world.gym.id, person_id=judge.id, role="judge") for judge in judges
        )
        cookies = [sign_in(session, judge.id, "phone", 1) for judge in judges]
    return Cup(
        row.id,
        f"{world.path}/competitions/{row.id}",
        [e.id for e in entries],
        [p.id for p in problems],
        cookies,
    )


async def listen(address: str, cup: Cup, screen: Screen) -> None:
    """Keep a screen up to date."""
    async with (
        httpx.AsyncClient(base_url=address + PREFIX, timeout=None) as client,
        client.stream("GET", f"{cup.path}/board/events") as answer,
    ):
        async for line in answer.aiter_lines():
            if line.startswith("data:"):
                moment, news = time.perf_counter(), json.loads(line[5:])
                screen.heard.append((moment, news["seq"]))
                screen.lines |= _lines(news)


def _lines(board: dict[str, Any]) -> dict[str, Any]:
    return {line["entry_id"]: line for one in board["categories"] for line in one["lines"]}


async def judge(address: str, cup: Cup, rate: float, seconds: float, seen: Seen) -> None:
    """All judges' events, at a fixed rate."""
    rng = np.random.default_rng(0)
    events: list[tuple[str, dict[str, Any]]] = []
    limits = httpx.Limits(max_connections=100, max_keepalive_connections=100)
    async with httpx.AsyncClient(base_url=address + PREFIX, limits=limits, timeout=60) as client:

        async def one(number: int, due: float) -> None:
            event, body = drawn(number)
            headers = {"cookie": f"{COOKIE}={cup.cookies[number % JUDGES]}"}
            for _ in range(2 if number % 50 == 0 else 1):
                try:
                    answer = await client.put(
                        f"{cup.path}/events/{event}", json=body, headers=headers
                    )
                except httpx.HTTPError:
                    seen.statuses[0] += 1
                    continue
                seen.statuses[answer.status_code] += 1
                if answer.status_code == 201:
                    moment = time.perf_counter()
                    seen.answered[answer.json()["seq"]] = moment
                    seen.waited.append(moment - due)
                    seen.accepted.add(event)
                    events.append((event, body))

        def drawn(number: int) -> tuple[str, dict[str, Any]]:
            moment = now().isoformat()
            body: dict[str, Any] = {
                "device": f"judge-{number % JUDGES}",
                "number": number,
                "made_at": moment,
                "sent_at": moment,
            }
            if events and number % 20 == 0:
                event, taken = events[int(rng.integers(len(events)))]
                back = {name: taken[name] for name in ("entry_id", "problem_id")}
                return str(uuid4()), body | back | {"kind": "void", "target_id": event}
            body |= {
                "entry_id": str(cup.entries[int(rng.integers(COMPETITORS))]),
                "problem_id": str(cup.problems[int(rng.integers(PROBLEMS))]),
                "kind": str(rng.choice(["attempt", "zone", "top"], p=[0.4, 0.25, 0.35])),
                "n": int(rng.integers(1, 8)),
            }
            return str(uuid4()), body

        await paced(rate, seconds, one)


async def load(address: str, cup: Cup, args: Any) -> Seen:
    """Judges and listeners together."""
    seen = Seen(screens=[Screen() for _ in range(args.listeners)])
    listeners = [asyncio.create_task(listen(address, cup, screen)) for screen in seen.screens]
    while not all(screen.heard for screen in seen.screens):
        await asyncio.sleep(0.05)
    await judge(address, cup, args.rate, args.seconds, seen)
    await asyncio.sleep(3)  # the last news
    for task in listeners:
        task.cancel()
    await asyncio.gather(*listeners, return_exceptions=True)
    return seen


def behind(seen: Seen) -> list[float]:
    """Seconds from an event's answer to the line that has it, for each listener. After the last
    line nothing was missing, or `stale` finds it."""
    found = []
    for screen in seen.screens:
        numbers = np.array([number for _, number in screen.heard])
        moments = np.array([moment for moment, _ in screen.heard])
        for number, answered in seen.answered.items():
            later = np.flatnonzero(numbers >= number)
            if later.size:
                found.append(max(0.0, moments[later[0]] - answered))
    return found


def stale(address: str, cup: Cup, seen: Seen) -> int:
    """How many screens do not show in the end what the board says."""
    board = _lines(httpx.get(f"{address}{PREFIX}{cup.path}/board", timeout=60).json())
    return sum(screen.lines != board for screen in seen.screens)


def check(address: str, database: str, cup: Cup, seen: Seen) -> tuple[int, int]:
    """How many accepted events are not there, and how many ranks are not the reference's."""
    kept = Database(database)
    with kept.writing() as session:
        row = session.get_one(Competition, cup.id)
        facts = [
            Fact(e.id, e.entry_id, e.problem_id, e.kind, e.n, e.target_id, e.text)
            for e in session.scalars(select(ScoreEvent).where(ScoreEvent.competition_id == cup.id))
        ]
        sheet = load_sheet(session, row)
        session.execute(update(Competition).values(state="ended"))
    kept.close()
    lost = len(seen.accepted - {str(fact.id) for fact in facts})
    right = Reference(sheet, facts).ranks()
    board = httpx.get(f"{address}{PREFIX}{cup.path}/board", timeout=60).json()
    lines = [line for category in board["categories"] for line in category["lines"]]
    wrong = sum(right[UUID(line["entry_id"])] != line["rank"] for line in lines)
    return lost, wrong + abs(len(lines) - len(right))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--database", default="", help="of an empty PostgreSQL database")
    parser.add_argument("--rate", type=float, default=60.0, help="events a second")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--listeners", type=int, default=20)
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        server = Server(data, args.database)
        cup = fill(server)
        server.close()
        settings = {"workers": "0", "requests_per_minute": "0"}
        settings |= {"database": args.database} if args.database else {}
        process = Process(data, "serve", "--port", "0", **settings)
        try:
            before = cpu_s(process.pid)
            seen = asyncio.run(load(process.first_line, cup, args))
            spent = cpu_s(process.pid) - before
            late = stale(process.first_line, cup, seen)
            lost, wrong = check(process.first_line, server.settings.database_url, cup, seen)
        finally:
            process.stop()
    report(seen, lost, wrong, args)
    print(f"screens that show something else in the end: {late} of {args.listeners}")
    each = 1000 * spent / max(1, sum(seen.statuses.values()))
    print(
        f"processor time of the server: {each:.1f} ms an event, {each * args.rate / 1000:.2f} cores"
    )
    return int(lost > 0 or wrong > 0 or late > 0)


def report(seen: Seen, lost: int, wrong: int, args: Any) -> None:
    """Print the results."""
    kind = "PostgreSQL" if args.database else "SQLite"
    print(
        f"{kind}, {args.rate:.0f} events a second for {args.seconds:.0f} s, {COMPETITORS} "
        f"competitors, {JUDGES} judges, {args.listeners} listeners, {available_cores()} cores, "
        f"load {os.getloadavg()[0]:.1f}"
    )
    for name, values in (("answered after", seen.waited), ("board behind", behind(seen))):
        p50, p95, most = np.percentile(values, [50, 95, 100])
        print(f"{name:<15} p50 {p50:5.2f}  p95 {p95:5.2f}  most {most:5.2f} s")
    bad = sum(number for status, number in seen.statuses.items() if status not in (200, 201))
    print(
        f"events accepted: {len(seen.accepted)}, refused: {bad}, lost: {lost}, "
        f"sent twice and kept once: {seen.statuses[200]}"
    )
    print(f"ranks other than the reference's: {wrong}")


if __name__ == "__main__":
    raise SystemExit(main())
