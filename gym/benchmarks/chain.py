"""How long a board takes whose events strike each other in one long chain, by its length.

    python -m gym.benchmarks.chain [--database URL] [--events 50000]

One competitor, one problem: a top, its void, the void of that, and so on, put in past the
application, which refuses such chains. Prints the seconds of the board of all events, and of finding
out which of the first hundred count. The time is linear where the last column is near two.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from uuid import UUID, uuid4

from gym.tests.worlds import Server, make_world
from sqlalchemy import insert

from walltopo_gym.clock import now
from walltopo_gym.competitions.history import board_of, struck_events
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Problem,
    Round,
    ScoreEvent,
)


def fill(server: Server, events: int) -> tuple[UUID, list[UUID]]:
    """Store a competition with a chain of events; return both ids in order."""
    world = make_world(server)
    cup = Competition(
        id=uuid4(),
        gym_id=world.gym.id,
        name="Cup",
        format="festival",
        state="running",
        last_seq=events,
    )
    category = Category(id=uuid4(), competition_id=cup.id, place=0, name="Open")
    session_round = Round(
        id=uuid4(),
        competition_id=cup.id,
        place=0,
        name="Session",
        kind="open",
        scoring={"rules": "points"},
        state="running",
        begun_at=now(),
    )
    problem = Problem(id=uuid4(), round_id=session_round.id, place=0, name="A", category_ids=[])
    entry = Entry(id=uuid4(), competition_id=cup.id, category_id=category.id, bib=1, name="Jana")
    ids = [uuid4() for _ in range(events)]
    at = now()
    rows = [
        {
            "id": event,
            "competition_id": cup.id,
            "seq": number + 1,
            "entry_id": entry.id,
            "problem_id": problem.id,
            "kind": "void" if number else "top",
            "n": None if number else 1,
            "target_id": ids[number - 1] if number else None,
            "text": "",
            "device": "phone",
            "number": number,
            "made_at": at,
            "climbed_at": at,
            "at": at,
        }
        for number, event in enumerate(ids)
    ]
    with server.database.writing() as session:
        for new in ([cup], [category, session_round], [problem, entry]):
            session.add_all(new)
            session.flush()
        session.execute(insert(ScoreEvent), rows)
    return cup.id, ids


def seconds(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def measure(server: Server, events: int) -> tuple[float, float]:
    """Return the seconds of a board of all events, and of whether the first hundred count."""
    competition, ids = fill(server, events)
    with server.database.reading() as session:
        row = session.get_one(Competition, competition)
        board = seconds(lambda: board_of(session, row).view())
        counted = seconds(lambda: struck_events(session, competition, ids[:100]))
    return board, counted


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--database", default="", help="URL of an empty PostgreSQL database")
    parser.add_argument("--events", type=int, default=50_000)
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        server = Server(Path(folder), args.database)
        print(f"{'events':>8} {'board':>8} {'of 100':>8}   seconds; ratio to half as many")
        before: float | None = None
        for events in (args.events // 8, args.events // 4, args.events // 2, args.events):
            board, listed = measure(server, events)
            ratio = "" if before is None else f"{board / before:.1f}"
            print(f"{events:8d} {board:8.2f} {listed:8.2f}   {ratio}")
            before = board
        server.close()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
