"""Connections that may neither last nor multiply.

uvicorn bounds how long a finished connection idles, but not how long a request may take to arrive
or an answer to be fetched; and its `limit_concurrency` refuses newcomers while the slow ones stay.
Here each has a deadline, and at the limit the one that has waited longest makes room (where all are
being answered, the oldest): hundreds of slow connections cannot keep a browser out.
"""

from __future__ import annotations

import asyncio

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

__all__ = ["MOST", "Connection"]

MOST = 64  # open at once; a browser opens six
ARRIVE_S = 20.0  # from a request's first byte to its last
FETCH_S = 30.0  # for the hundred kB that may lie between us and who takes them


class Connection(H11Protocol):
    """HTTP/1.1 by h11, with deadlines."""

    arrival: asyncio.TimerHandle | None = None
    fetching: asyncio.TimerHandle | None = None
    since = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._make_room()
        self._expect_request()

    def connection_lost(self, exc: Exception | None) -> None:
        self._forget()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.conn.their_state in (h11.IDLE, h11.SEND_BODY):
            self._expect_request()
            return
        self.since = self.loop.time()
        if self.arrival is not None:
            self.arrival.cancel()
            self.arrival = None

    def send_400_response(self, msg: str) -> None:
        """Where an answer is under way, h11 takes no other one: there is nothing left to say."""
        try:
            super().send_400_response(msg)
        except h11.LocalProtocolError:
            self._drop()

    def pause_writing(self) -> None:
        super().pause_writing()
        self.fetching = self.loop.call_later(FETCH_S, self._drop)

    def resume_writing(self) -> None:
        super().resume_writing()
        if self.fetching is not None:
            self.fetching.cancel()
            self.fetching = None

    @property
    def waits(self) -> bool:
        """It is the other side's turn: to send a request, or to take the answer."""
        answered = self.cycle is None or self.cycle.response_complete
        return answered or self.arrival is not None or self.fetching is not None

    def _expect_request(self) -> None:
        """Start the clock at the first byte; later ones do not wind it up again."""
        if self.arrival is None:
            self.since = self.loop.time()
            self.arrival = self.loop.call_later(ARRIVE_S, self._drop)

    def _make_room(self) -> None:
        if len(self.connections) <= MOST:
            return
        others = [one for one in self.connections if isinstance(one, Connection)]
        others.remove(self)
        # A newcomer is never the one to go: those who are slow would keep it out.
        min(others, key=lambda one: (not one.waits, one.since))._drop()

    def _drop(self) -> None:
        """Away with it, at once: `close` would wait until the other side has taken everything."""
        self._forget()
        self.connections.discard(self)
        self.transport.abort()

    def _forget(self) -> None:
        for timer in (self.arrival, self.fetching):
            if timer is not None:
                timer.cancel()
