"""Limits of attempts, photos and webhooks hold when all requests come at once."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from threading import Barrier
from uuid import UUID, uuid4

import pytest
from gym.tests.worlds import Server, World
from sqlalchemy.orm import Session

from walltopo_gym.accounts.limits import count_code, count_mail, count_report, count_sign_in
from walltopo_gym.errors import ConflictError, TooManyError
from walltopo_gym.scans.receiving import photo_to_receive

pytestmark = pytest.mark.both_databases("PostgreSQL lets writers in at once")

_AT_ONCE = 20

# One person's attempts from one network or from many; the limits are those of accounts/limits.py.
_COUNTED: list[tuple[str, int, Callable[[UUID, Session, int], None]]] = [
    ("sign-in", 10, lambda who, session, _: count_sign_in(session, f"{who}", f"{who}", None)),
    ("known", 10, lambda who, session, _: count_sign_in(session, "a", "b", f"{who}")),
    ("code", 10, lambda who, session, _: count_code(session, who)),
    ("mail", 3, lambda who, session, _: count_mail(session, "reset", f"{who}", f"{who}", None)),
    ("mails", 10, lambda who, session, n: count_mail(session, "reset", f"{who}", f"{n}", None)),
]


def accepted(server: Server, attempt: Callable[[Session, int], object]) -> int:
    """Return how many of many attempts at once are accepted."""
    together = Barrier(_AT_ONCE)

    def try_it(number: int) -> bool:
        together.wait()
        try:
            with server.database.writing() as session:
                attempt(session, number)
        except (TooManyError, ConflictError):
            return False
        return True

    with ThreadPoolExecutor(_AT_ONCE) as pool:
        return sum(pool.map(try_it, range(_AT_ONCE)))


@pytest.mark.parametrize(
    ("most", "count"), [one[1:] for one in _COUNTED], ids=[one[0] for one in _COUNTED]
)
def test_of_attempts_at_once_no_more_are_let_through(
    server: Server, most: int, count: Callable[[UUID, Session, int], None]
) -> None:
    for _ in range(3):
        assert accepted(server, partial(count, uuid4())) == most


def test_attempts_of_others_are_not_counted(server: Server) -> None:
    assert accepted(server, lambda session, _: count_report(session, uuid4())) == _AT_ONCE


def test_of_photos_at_once_no_more_are_accepted(world: World) -> None:
    scan = world.scan()

    def add(session: Session, number: int) -> None:
        photo_to_receive(session, scan, f"{number}.jpg", 9, None, 5)

    assert accepted(world.server, add) == 5


def test_of_webhooks_at_once_no_more_are_made(world: World) -> None:
    path, body = f"{world.path}/webhooks", {"url": "https://hooks.example.com/"}
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        answers = pool.map(
            lambda _: world.server.ask("POST", path, world.owner, body), range(_AT_ONCE)
        )
        statuses = sorted(answer.status_code for answer in answers)
    assert statuses == [201] * 10 + [409] * (_AT_ONCE - 10)
