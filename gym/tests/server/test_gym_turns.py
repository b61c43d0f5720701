"""Heavy requests take turns: few wait, the others are refused, and other requests go on."""

from __future__ import annotations

import asyncio
from datetime import datetime

import httpx
import pytest
from fastapi import FastAPI
from gym.tests.competitions.contest import Contest
from gym.tests.worlds import ORIGIN, World, make_world
from sqlalchemy.orm import Session

from walltopo_gym.api import turns
from walltopo_gym.api.error_responses import handle_errors
from walltopo_gym.api.turns import turn_for
from walltopo_gym.clock import now
from walltopo_gym.competitions import live
from walltopo_gym.competitions.board import Leaderboard
from walltopo_gym.competitions.history import board_of
from walltopo_gym.competitions.models import Competition


class Heavy:
    """An application with one heavy endpoint, which works until `done` is set."""

    def __init__(self) -> None:
        self.app = FastAPI()
        self.app.state.turns = {}
        handle_errors(self.app)
        self.done, self.working, self.most = asyncio.Event(), 0, 0
        self.app.get("/heavy", dependencies=[turn_for("heavy")])(self._work)

    async def _work(self) -> None:
        self.working += 1
        self.most = max(self.most, self.working)
        await self.done.wait()
        self.working -= 1

    async def ask(self, sender: str) -> int:
        transport = httpx.ASGITransport(self.app, client=(sender, 1))
        async with httpx.AsyncClient(transport=transport, base_url=ORIGIN) as client:
            return (await client.get("/heavy")).status_code

    def waiting(self) -> int:
        found: turns.Turns | None = self.app.state.turns.get("heavy")
        return 0 if found is None else found._limiter.statistics().tasks_waiting


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(turns, "_MAX_WAITING", 3)
    monkeypatch.setattr(turns, "_MAX_OF_NETWORK", 2)


@pytest.mark.usefixtures("few")
def test_few_wait_for_their_turn_and_the_others_are_refused_at_once() -> None:
    async def run() -> None:
        heavy = Heavy()
        first = [asyncio.create_task(heavy.ask("192.0.2.1")) for _ in range(2)]
        while heavy.working + heavy.waiting() < 2:
            await asyncio.sleep(0)
        assert await heavy.ask("192.0.2.1") == 429  # the third of one network
        others = [asyncio.create_task(heavy.ask(f"192.0.2.{n}")) for n in (2, 3)]
        while heavy.waiting() < 3:
            await asyncio.sleep(0)
        assert await heavy.ask("192.0.2.4") == 429  # three wait already
        heavy.done.set()
        assert set(await asyncio.gather(*first, *others)) == {200}
        assert heavy.most == 1
        assert await heavy.ask("192.0.2.1") == 200  # a refused client may come later

    asyncio.run(run())


def test_a_request_whose_client_has_gone_gives_its_turn_to_the_next() -> None:
    async def run() -> None:
        heavy = Heavy()
        scope = {
            "type": "http",
            "method": "GET",
            "path": "/heavy",
            "query_string": b"",
            "headers": [],
            "client": ("192.0.2.9", 1),
            "server": ("test", 80),
            "scheme": "http",
            "http_version": "1.1",
            "root_path": "",
        }
        begun = asyncio.create_task(heavy.ask("192.0.2.1"))
        while not heavy.working:
            await asyncio.sleep(0)
        seen = heavy.working
        statuses: list[int] = []

        async def receive() -> dict[str, object]:
            return {"type": "http.disconnect"}

        async def send(message: dict[str, object]) -> None:
            if message["type"] == "http.response.start":
                statuses.append(int(str(message["status"])))

        gone = asyncio.create_task(heavy.app(scope, receive, send))  # type: ignore[arg-type]
        while not heavy.waiting():
            await asyncio.sleep(0)
        heavy.done.set()
        await asyncio.gather(begun, gone)
        assert (seen, heavy.most, statuses) == (1, 1, [429])

    asyncio.run(run())


def test_a_board_of_the_past_is_computed_once(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    contest = Contest(make_world(world.server, world.people, visibility="public")).make()
    contest.move("running")
    entry = contest.entry("Jana")
    contest.say(entry, "top", 0, 1)
    computed = []

    def counted(session: Session, row: Competition, until: datetime) -> Leaderboard:
        computed.append(until)
        return board_of(session, row, until)

    monkeypatch.setattr(live, "board_of", counted)
    at = now()
    boards = [contest.board(at=at) for _ in range(3)]
    assert boards[0] == boards[1] == boards[2]
    assert len(computed) == 1
    contest.say(entry, "top", 1, 1)  # later than that moment
    assert contest.board(at=at) == boards[0]
    assert len(computed) == 1
    assert contest.board(at=now()) != boards[0]
    assert len(computed) == 2
