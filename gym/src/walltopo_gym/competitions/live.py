"""Boards that are looked at, kept in memory and told to whoever listens.

A board takes in the events that it has not had yet, by their numbers, from the database: whichever
server wrote them. It is made once for all that look at it.
"""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict, deque
from collections.abc import AsyncIterator
from dataclasses import dataclass, field, fields
from threading import Lock
from typing import Any, Final
from uuid import UUID

import msgspec
from anyio import to_thread
from sqlalchemy.exc import InterfaceError, OperationalError
from sqlalchemy.orm import Session

from walltopo_gym.competitions.board import Board
from walltopo_gym.competitions.history import board_of, catch_up
from walltopo_gym.competitions.models import Competition
from walltopo_gym.competitions.sheet import load_sheet
from walltopo_gym.competitions.told import BoardTold, CategoryLines, Line
from walltopo_gym.database.engine import Database

_LOG = logging.getLogger("walltopo_gym.competitions")

_LOOK_S: Final = 0.3  # how often the database is asked for what is new
_MOST_BOARDS: Final = 20
_KEPT_NEWS: Final = 20

_Key = tuple[UUID, bool]  # competition, for the public


@dataclass
class _Kept:
    """A board in memory; `of`: revision and moment of freezing."""

    lock: Lock = field(default_factory=Lock)
    board: Board | None = None
    of: tuple[Any, ...] = ()
    told: BoardTold | None = None


class LiveBoards:
    """The boards of a server.

    Parameters
    ----------
    database : where the events are.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._kept: OrderedDict[_Key, _Kept] = OrderedDict()
        self._lock = Lock()
        self._channels: dict[_Key, _Channel] = {}

    def told(self, session: Session, row: Competition, *, public: bool) -> BoardTold:
        """The board as it is now; for the public as it was frozen."""
        key = row.id, public and row.frozen_at is not None
        with self._lock:
            kept = self._kept.setdefault(key, _Kept())
            self._kept.move_to_end(key)
            while len(self._kept) > _MOST_BOARDS:
                self._kept.popitem(last=False)
        with kept.lock:
            return _brought_up(session, row, kept, frozen=key[1])

    async def watch(self, competition: UUID, *, public: bool) -> AsyncIterator[str]:
        """The board in JSON, and then what is otherwise in it, while the competition runs."""
        key = competition, public
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = _Channel(self._database, self, competition, public)
        channel.listeners += 1
        try:
            async for news in channel.listen():
                yield news
        finally:
            channel.listeners -= 1
            if not channel.listeners:
                channel.close()
                if self._channels.get(key) is channel:
                    del self._channels[key]


class _Channel:
    """What is told to all who listen to one board; asked of the database by one task for all."""

    def __init__(
        self, database: Database, boards: LiveBoards, competition: UUID, public: bool
    ) -> None:
        self._database, self._boards = database, boards
        self._competition, self._public = competition, public
        self.listeners = 0
        self._number = 0
        self._news: deque[tuple[int, str]] = deque(maxlen=_KEPT_NEWS)
        self._told: BoardTold | None = None
        self._is_over = False
        self._changed = asyncio.Event()
        self._task = asyncio.create_task(self._ask())

    def close(self) -> None:
        """Ask no more."""
        self._task.cancel()

    async def listen(self) -> AsyncIterator[str]:
        """All of it, then the news; all of it again to who is too slow for them."""
        while self._told is None and not self._is_over:
            await self._changed.wait()
        at = -1
        while self._told is not None:
            news = [(number, text) for number, text in self._news if number > at]
            if at < 0 or (news and news[0][0] != at + 1):
                at = self._number
                yield _whole(self._told)
            else:
                for number, text in news:
                    at = number
                    yield text
            if self._is_over and at == self._number:
                return
            if at == self._number:
                await self._changed.wait()

    async def _ask(self) -> None:
        while not self._is_over:
            try:
                told = await to_thread.run_sync(self._now)
            except (OperationalError, InterfaceError) as error:
                _LOG.error("the database does not answer: %s", error)
                told = self._told
            self._take(told)
            await asyncio.sleep(_LOOK_S)

    def _now(self) -> BoardTold | None:
        with self._database.reading() as session:
            row = session.get(Competition, self._competition)
            if row is None:
                return None
            before = self._told
            if before is not None and _is_same(row, before, public=self._public):
                return before
            return self._boards.told(session, row, public=self._public)

    def _take(self, told: BoardTold | None) -> None:
        before, self._told = self._told, told or self._told
        if told is not None and before is not None and told is not before:
            text = _difference(before, told)
            if text:
                self._number += 1
                self._news.append((self._number, text))
        self._is_over = told is None or told.state != "running"
        if told is not before or self._is_over:
            changed, self._changed = self._changed, asyncio.Event()
            changed.set()


def _is_same(row: Competition, told: BoardTold, *, public: bool) -> bool:
    frozen = row.frozen_at if public else None
    seq = told.seq if frozen else row.last_seq  # what came after the freezing is not in it
    return (row.revision, frozen, seq) == (told.revision, told.frozen_at, told.seq)


def _brought_up(session: Session, row: Competition, kept: _Kept, *, frozen: bool) -> BoardTold:
    of = (row.revision, row.frozen_at) if frozen else (row.revision,)
    if kept.board is None or (frozen and of != kept.of):
        kept.board, kept.told = board_of(session, row, row.frozen_at if frozen else None), None
    elif of != kept.of:
        kept.board.results.use(load_sheet(session, row))
        kept.told = None
    kept.of = of
    if not frozen and catch_up(session, row.id, kept.board):
        kept.told = None
    if kept.told is None:
        kept.told = kept.board.told()
        if not frozen:  # who sees it go on is not told that others do not
            kept.told = _with(kept.told, frozen_at=None)
    return kept.told


def _with(told: BoardTold, **other: Any) -> BoardTold:
    return BoardTold(**{**_fields(told), **other})


def _fields(told: BoardTold) -> dict[str, Any]:
    return {one.name: getattr(told, one.name) for one in fields(told)}


def _whole(told: BoardTold) -> str:
    return msgspec.json.encode({"kind": "board", **_fields(told)}).decode()


def _difference(before: BoardTold, told: BoardTold) -> str:
    """What is otherwise; all of it where more than scores is."""
    if (before.revision, before.frozen_at) != (told.revision, told.frozen_at):
        return _whole(told)
    changed = [
        CategoryLines(new.id, new.name, lines)
        for old, new in zip(before.categories, told.categories, strict=True)
        if (lines := _changed(old.lines, new.lines))
    ]
    if not changed and before.teams == told.teams:
        return ""
    news = {"kind": "lines", "seq": told.seq, "at": told.at, "categories": changed,
            "teams": told.teams}  # fmt: skip
    return msgspec.json.encode(news).decode()


def _changed(before: list[Line], now: list[Line]) -> list[Line]:
    known = {line.entry_id: line for line in before}
    # A line that nothing touched is the same object, or at least equal.
    return [line for line in now if known.get(line.entry_id) != line]
