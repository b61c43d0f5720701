"""How much and how often one may ask: bounds that hold for every endpoint.

Counted by `limits` in this process: two servers behind a proxy let through twice as much. What must
hold over all servers (guessing passwords, mails) is counted in the database (accounts/limits.py).
"""

from __future__ import annotations

from typing import Final

from limits import RateLimitItemPerMinute
from limits.storage import MemoryStorage
from limits.strategies import SlidingWindowCounterRateLimiter
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from walltopo_gym.api.problems import problem
from walltopo_gym.api.services import network_of

LONGEST_BODY: Final = 2_000_000  # bytes; a photo's are bounded by what was announced
# The app's files cost nothing to send, and a phone that installs the app asks for all of them at
# once: a few at a hall's entrance would be as many requests as one network may make.
_FREE: Final = "/assets/"


class Bounds:
    """Refuses a network that asks too often.

    Parameters
    ----------
    per_minute : requests of one network; 0: no limit.
    """

    def __init__(self, app: ASGIApp, per_minute: int) -> None:
        self._app = app
        self._limit = RateLimitItemPerMinute(per_minute) if per_minute else None
        self._counter = SlidingWindowCounterRateLimiter(MemoryStorage())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        is_free = scope["type"] != "http" or scope["path"].startswith(_FREE)
        if is_free or self._limit is None:
            await self._app(scope, receive, send)
            return
        if not self._counter.hit(self._limit, network_of(Request(scope))):
            answer = problem(429, "too many requests", "Wait a minute.", {"retry-after": "60"})
            await answer(scope, receive, send)
            return
        await self._app(scope, receive, send)
