"""Heavy requests take turns: few are worked on at a time, a few wait, the others are refused.

A request waits before it begins its transaction and without a thread, so that those that wait hold
up no other kind of request. One whose client has gone gives its turn to the next.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final

from anyio import CapacityLimiter
from fastapi import Depends, Request

from walltopo_gym.api.services import network_of
from walltopo_gym.errors import TooManyError

_MAX_WAITING: Final = 32  # requests of one kind
_MAX_OF_NETWORK: Final = 8  # of one kind, from one network, with the one that is worked on
_AGAIN_S: Final = 10


class Turns:
    """The turns of one kind of heavy work in this process.

    Parameters
    ----------
    at_once : requests that are worked on at a time.
    """

    def __init__(self, at_once: int) -> None:
        self._limiter = CapacityLimiter(at_once)
        self._networks = Counter[str]()

    @asynccontextmanager
    async def turn(self, request: Request) -> AsyncIterator[None]:
        """Wait for a turn and keep it during the block.

        Raises
        ------
        TooManyError : too many wait already; or the client has gone, and reads no response.
        """
        network = network_of(request)
        waiting = self._limiter.statistics().tasks_waiting
        if waiting >= _MAX_WAITING or self._networks[network] >= _MAX_OF_NETWORK:
            raise TooManyError("server-busy", _AGAIN_S)
        self._networks[network] += 1
        try:
            async with self._limiter:
                if await request.is_disconnected():
                    raise TooManyError("server-busy", _AGAIN_S)
                yield
        finally:
            self._networks -= Counter({network: 1})


def turn_for(work: str, at_once: int = 1, *, when: Callable[[Request], bool] | None = None) -> Any:
    """Return a dependency that gives its endpoint a turn. It stands before `session: Db`.

    Parameters
    ----------
    work : the kind of work; endpoints of one kind share its turns.
    when : tells whether a request is heavy; None: all are.
    """

    async def take(request: Request) -> AsyncIterator[None]:
        if when is not None and not when(request):
            yield
            return
        turns: Turns = request.app.state.turns.setdefault(work, Turns(at_once))
        async with turns.turn(request):
            yield

    return Depends(take, scope="function")
