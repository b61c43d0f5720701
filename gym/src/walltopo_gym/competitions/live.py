"""Watched boards, kept in memory and streamed to their listeners.

A board reads new events from the database by their numbers, whichever server stored them. It is
computed once for all listeners.
"""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict, deque
from collections.abc import AsyncIterator
from dataclasses import dataclass, field, fields
from datetime import datetime
from threading import Lock
from typing import Any, Final
from uuid import UUID

import msgspec
from anyio import to_thread
from sqlalchemy import func, select
from sqlalchemy.exc import InterfaceError, OperationalError
from sqlalchemy.orm import Session

from walltopo_gym.competitions.board import Leaderboard
from walltopo_gym.competitions.board_view import BoardView, CategoryLines, Line
from walltopo_gym.competitions.history import board_of, catch_up, seq_at
from walltopo_gym.competitions.models import Competition, Round
from walltopo_gym.competitions.ranking import Step
from walltopo_gym.database.engine import Database

_LOG = logging.getLogger("walltopo_gym.competitions")

_LOOK_S: Final = 0.3  # how often the database is queried for new events
_MAX_BOARDS: Final = 20
_MAX_PAST: Final = 20  # boards of past moments that are kept
_KEPT_NEWS: Final = 20

_BEGUN: Final = select(func.count()).select_from(Round)

_Key = tuple[UUID, bool]  # competition, for the public


@dataclass
class _CachedBoard:
    """A board in memory; `of`: its revision and freeze."""

    lock: Lock = field(default_factory=Lock)
    board: Leaderboard | None = None
    of: tuple[Any, ...] = ()
    view: BoardView | None = None


class LiveBoards:
    """The boards of a server.

    Parameters
    ----------
    database : where the events are.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._kept: OrderedDict[_Key, _CachedBoard] = OrderedDict()
        self._past: OrderedDict[tuple[Any, ...], BoardView] = OrderedDict()
        self._lock = Lock()
        self._channels: dict[_Key, _Channel] = {}

    def view(self, session: Session, row: Competition, *, public: bool) -> BoardView:
        """Return the current board; for the public the frozen one."""
        kept, frozen = self._of(row, public=public)
        with kept.lock:
            return _up_to_date_view(session, row, kept, frozen=frozen)

    def compare(
        self, session: Session, row: Competition, first: UUID, second: UUID, *, public: bool
    ) -> tuple[list[Step], dict[UUID, int | None]]:
        """Return the comparison of two competitors on that board, and the ranks by entry.

        Raises
        ------
        NotFoundError : no such entries in one category.
        """
        kept, frozen = self._of(row, public=public)
        with kept.lock:
            view = _up_to_date_view(session, row, kept, frozen=frozen)
            assert kept.board is not None
            steps = kept.board.compare(first, second)
        return steps, {line.entry_id: line.rank for of in view.categories for line in of.lines}

    def board_at(
        self, session: Session, row: Competition, at: datetime, *, public: bool
    ) -> BoardView:
        """Return the board of a moment; the public sees no moment after the freeze."""
        if public and row.frozen_at is not None:
            at = min(at, row.frozen_at)
        begun = session.scalar(_BEGUN.where(Round.competition_id == row.id, Round.begun_at <= at))
        key = row.id, row.revision, row.frozen_at, seq_at(session, row.id, at), begun
        with self._lock:
            view = self._past.get(key)
        if view is None:
            view = board_of(session, row, at).view()
            with self._lock:
                self._past[key] = view
                while len(self._past) > _MAX_PAST:
                    self._past.popitem(last=False)
        return view

    def _of(self, row: Competition, *, public: bool) -> tuple[_CachedBoard, bool]:
        """Return a place for the board, and whether it is the frozen one."""
        key = row.id, public and row.frozen_at is not None
        with self._lock:
            kept = self._kept.setdefault(key, _CachedBoard())
            self._kept.move_to_end(key)
            while len(self._kept) > _MAX_BOARDS:
                self._kept.popitem(last=False)
        return kept, key[1]

    async def watch(self, competition: UUID, *, public: bool) -> AsyncIterator[str]:
        """Yield the board as JSON, and then its changes while the competition runs."""
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
    """The updates of one board, queried by one task for all of its listeners."""

    def __init__(
        self, database: Database, boards: LiveBoards, competition: UUID, public: bool
    ) -> None:
        self._database, self._boards = database, boards
        self._competition, self._public = competition, public
        self.listeners = 0
        self._number = 0
        self._news: deque[tuple[int, str]] = deque(maxlen=_KEPT_NEWS)
        self._view: BoardView | None = None
        self._is_over = False
        self._changed = asyncio.Event()
        self._task = asyncio.create_task(self._ask())

    def close(self) -> None:
        """Stop querying."""
        self._task.cancel()

    async def listen(self) -> AsyncIterator[str]:
        """Yield the board, then its changes; a slow listener gets the whole board again."""
        while self._view is None and not self._is_over:
            await self._changed.wait()
        at = -1
        while self._view is not None:
            news = [(number, text) for number, text in self._news if number > at]
            if at < 0 or (news and news[0][0] != at + 1):
                at = self._number
                yield _encode_board(self._view)
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
                view = await to_thread.run_sync(self._now)
            except (OperationalError, InterfaceError) as error:
                _LOG.error("the database does not answer: %s", error)
                view = self._view
            self._take(view)
            await asyncio.sleep(_LOOK_S)

    def _now(self) -> BoardView | None:
        with self._database.reading() as session:
            row = session.get(Competition, self._competition)
            if row is None:
                return None
            before = self._view
            if before is not None and _is_same(row, before, public=self._public):
                return before
            return self._boards.view(session, row, public=self._public)

    def _take(self, view: BoardView | None) -> None:
        before, self._view = self._view, view or self._view
        if view is not None and before is not None and view is not before:
            text = _board_difference(before, view)
            if text:
                self._number += 1
                self._news.append((self._number, text))
        self._is_over = view is None or view.state != "running"
        if view is not before or self._is_over:
            changed, self._changed = self._changed, asyncio.Event()
            changed.set()


def _is_same(row: Competition, view: BoardView, *, public: bool) -> bool:
    frozen = row.frozen_at if public else None
    seq = view.seq if frozen else row.last_seq  # what came after the freezing is not in it
    return (row.revision, frozen, seq) == (view.revision, view.frozen_at, view.seq)


def _up_to_date_view(
    session: Session, row: Competition, kept: _CachedBoard, *, frozen: bool
) -> BoardView:
    of = (row.revision, row.frozen_at) if frozen else (row.revision,)
    if kept.board is None or of != kept.of:  # names and texts may have been removed, too
        kept.board, kept.view = board_of(session, row, row.frozen_at if frozen else None), None
    kept.of = of
    if not frozen and catch_up(session, row.id, kept.board):
        kept.view = None
    if kept.view is None:
        kept.view = kept.board.view()
        if not frozen:  # judges see it go on and get no notice of the freeze
            kept.view = _view_with(kept.view, frozen_at=None)
    return kept.view


def _view_with(view: BoardView, **other: Any) -> BoardView:
    return BoardView(**{**_view_fields(view), **other})


def _view_fields(view: BoardView) -> dict[str, Any]:
    return {one.name: getattr(view, one.name) for one in fields(view)}


def _encode_board(view: BoardView) -> str:
    return msgspec.json.encode({"kind": "board", **_view_fields(view)}).decode()


def _board_difference(before: BoardView, view: BoardView) -> str:
    """Return the changed lines, or the whole board if more than scores changed."""
    if (before.revision, before.frozen_at) != (view.revision, view.frozen_at):
        return _encode_board(view)
    changed = [
        CategoryLines(new.id, new.name, lines)
        for old, new in zip(before.categories, view.categories, strict=True)
        if (lines := _changed_lines(old.lines, new.lines))
    ]
    if not changed and before.teams == view.teams:
        return ""
    news = {
        "kind": "lines",
        "seq": view.seq,
        "at": view.at,
        "categories": changed,
        "teams": view.teams,
    }
    return msgspec.json.encode(news).decode()


def _changed_lines(before: list[Line], now: list[Line]) -> list[Line]:
    known = {line.entry_id: line for line in before}
    # A line that nothing touched is the same object, or at least equal.
    return [line for line in now if known.get(line.entry_id) != line]
