"""The live board: sent to many listeners, from one computation, by any server."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any
from uuid import UUID

import pytest
from anyio import to_thread
from gym.tests.competitions.contest import Contest
from gym.tests.worlds import World, make_world

from walltopo_gym.competitions import live
from walltopo_gym.competitions.live import LiveBoards
from walltopo_gym.database.engine import Database

pytestmark = pytest.mark.both_databases("concurrent events")


@pytest.fixture
def contest(world: World) -> Contest:
    """A festival that runs."""
    made = Contest(make_world(world.server, world.people, visibility="public")).make()
    made.move("running")
    return made


class Listener:
    """A listener that follows the board by its updates."""

    def __init__(self, news: AsyncIterator[str]) -> None:
        self._news = news
        self.kinds: list[str] = []
        self.lines: dict[str, dict[str, Any]] = {}
        self.seq = -1
        self.over = False

    async def until(self, seq: int) -> None:
        """Listen until an event is in it, or the news end."""
        while self.seq < seq:
            try:
                view = json.loads(await asyncio.wait_for(anext(self._news), 600))
            except StopAsyncIteration:
                self.over = True
                return
            self.kinds.append(view["kind"])
            self.seq = view["seq"]
            if view["kind"] == "board":
                self.lines = {}
            for category in view["categories"]:
                self.lines |= {line["entry_id"]: line for line in category["lines"]}

    def ranks(self) -> list[tuple[int | None, str]]:
        found = [(line["rank"], line["name"]) for line in self.lines.values()]
        return sorted(found, key=lambda line: (line[0] is None, line))


def test_two_listeners_one_computation_two_servers(
    contest: Contest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An event through one server is sent by another one, once for all listeners."""
    monkeypatch.setattr(live, "_LOOK_S", 0.02)
    # Another process has connections and a board of its own.
    other = Database(contest.world.server.database.url)
    boards = LiveBoards(other)
    calls: list[Any] = []
    view = boards.view

    def counted(*given: Any, **named: Any) -> Any:
        calls.append(given)
        return view(*given, **named)

    monkeypatch.setattr(boards, "view", counted)
    entries = [contest.entry(name) for name in ("Jana", "Ivo", "Uma")]
    competition = UUID(contest.sheet["id"])

    async def watch() -> None:
        listeners = [Listener(boards.watch(competition, public=True)) for _ in range(5)]

        async def all_until(seq: int) -> None:
            await asyncio.gather(*(listener.until(seq) for listener in listeners))

        await all_until(0)
        for number, entry in enumerate(entries, 1):
            await to_thread.run_sync(contest.say, entry, "top", 0, number)
            await all_until(number)
        assert listeners[0].ranks() == [(1, "Jana"), (2, "Ivo"), (2, "Uma")]
        assert all(listener.lines == listeners[0].lines for listener in listeners)
        assert listeners[0].kinds == ["board", "lines", "lines", "lines"]
        assert len(calls) == 4  # not once for each listener
        # Somebody new on the sheet, and the end.
        await to_thread.run_sync(contest.entry, "Eva")
        await to_thread.run_sync(contest.move, "ended")
        await all_until(99)
        assert all(listener.over for listener in listeners)
        assert (None, "Eva") in listeners[0].ranks()

    asyncio.run(watch())
    other.close()


def test_a_frozen_board_stands_still_for_the_public_alone(
    contest: Contest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "_LOOK_S", 0.02)
    boards = LiveBoards(contest.world.server.database)
    entry = contest.entry("Jana")
    assert contest.ask("PUT", "/frozen", {"frozen": True}).is_success
    competition = UUID(contest.sheet["id"])

    async def watch() -> None:
        public = Listener(boards.watch(competition, public=True))
        judges = Listener(boards.watch(competition, public=False))
        await asyncio.gather(public.until(0), judges.until(0))
        await to_thread.run_sync(contest.say, entry, "top", 0, 1)
        await judges.until(1)
        assert judges.ranks() == [(1, "Jana")]
        await to_thread.run_sync(lambda: contest.ask("PUT", "/frozen", {"frozen": False}))
        await public.until(1)
        assert public.kinds == ["board", "board"]  # nothing in between
        assert public.ranks() == [(1, "Jana")]

    asyncio.run(watch())


def test_the_stream_of_one_that_does_not_run_ends(contest: Contest) -> None:
    contest.move("ended")
    answer = contest.ask("GET", "/board/events", who="nobody")
    assert answer.headers["content-type"].startswith("text/event-stream")
    news = [line for line in answer.text.splitlines() if line.startswith("data:")]
    assert [json.loads(line[5:])["kind"] for line in news] == ["board"]
