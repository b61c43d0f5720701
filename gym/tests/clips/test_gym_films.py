"""Films of clips: made where they are wanted, published by consent, reported, removed."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from gym.tests.clips.attempts import an_attempt
from gym.tests.clips.sending import announce, clips, confirm, readings, sent
from gym.tests.worlds import World, hold
from sqlalchemy import select, update

from walltopo_gym.accounts.models import AuditEntry, Profile
from walltopo_gym.clips import reading
from walltopo_gym.clips.child import Limits
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.reader import Found, Phase, ReadRequest
from walltopo_gym.clips.reading import tidy
from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Ban

pytestmark = pytest.mark.both_databases("cascades and filters in SQL")

FILM = bytes(range(256)) * 9000  # more than two pieces of the store


@pytest.fixture
def route(world: World) -> str:
    made = world.reviewed({1: [3, 1, 2]}, [hold(n, 0.0, 0.4 * n) for n in (3, 1, 2)])
    assert world.publish(made, {"number": 1, "name": "Moon"}).is_success
    rows = world.server.ask("GET", f"{world.path}/routes", world.people["member"]).json()
    return str(rows[0]["id"])


@pytest.fixture
def clip(world: World, route: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """A member's read clip with its film."""
    sent_clip = sent(world, "member", route, film=True)

    def read_it(request: ReadRequest, limits: Limits, report: Callable[[Phase], bool]) -> Any:
        assert request.film
        Path(request.film).write_bytes(FILM)
        return Found(an_attempt(), [1, 2, 3])

    monkeypatch.setattr(reading, "download_wall", lambda *_: None)
    monkeypatch.setattr(reading, "read_in_child", read_it)
    readings(world).read(sent_clip)
    return sent_clip


def ask(world: World, method: str, path: str, who: str, body: object = None, **headers: str) -> Any:
    return world.server.ask(method, f"{world.path}{path}", world.people[who], body, headers)


def film(world: World, clip: str, who: str, **headers: str) -> Any:
    return ask(world, "GET", f"/clips/{clip}/film", who, **headers)


def publish(world: World, clip: str, *, of_age: bool = True) -> Any:
    return ask(world, "PUT", f"/clips/{clip}/film", "member", {"of_age": of_age})


def published(world: World, clip: str) -> None:
    assert confirm(world, "member", clip, (0, 1)).is_success
    assert publish(world, clip).status_code == 204


def shown(world: World, route: str, who: str = "judge") -> list[str]:
    items = ask(world, "GET", f"/routes/{route}/films", who).json()["items"]
    return [item["clip_id"] for item in items]


def stored(world: World) -> list[str]:
    return world.server.services.store.keys("films/")


def test_a_film_is_its_climbers_until_it_is_published(world: World, route: str, clip: str) -> None:
    assert film(world, clip, "member").content == FILM
    assert film(world, clip, "judge").status_code == 404
    assert publish(world, clip).status_code == 409  # its moves are not confirmed
    assert shown(world, route) == []
    published(world, clip)
    assert shown(world, route) == [clip]
    assert film(world, clip, "judge").content == FILM
    assert clips(world, "member", route)[0]["published_at"] is not None


def test_nothing_is_kept_of_a_clip_without_a_wish_for_a_film(
    world: World, route: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read_it(request: ReadRequest, *_: Any) -> Any:
        assert request.film == ""
        return Found(an_attempt(), [1, 2, 3])

    one = sent(world, "member", route)
    monkeypatch.setattr(reading, "download_wall", lambda *_: None)
    monkeypatch.setattr(reading, "read_in_child", read_it)
    readings(world).read(one)
    assert f"films/{one}" not in stored(world)
    assert confirm(world, "member", one, (0, 1)).is_success
    assert publish(world, one).status_code == 409
    assert film(world, one, "member").status_code == 404


@pytest.mark.parametrize(
    ("wanted", "status", "part"),
    [
        ("bytes=0-", 206, FILM),
        ("bytes=5-1200004", 206, FILM[5:1200005]),
        ("bytes=-7", 206, FILM[-7:]),
        (f"bytes=10-{10**9}", 206, FILM[10:]),
        (f"bytes={len(FILM)}-", 416, b""),
        ("bytes=9-3", 200, FILM),
        ("lines=1-2", 200, FILM),
    ],
)
def test_a_player_gets_the_part_that_it_asks_for(
    world: World, clip: str, wanted: str, status: int, part: bytes
) -> None:
    answer = film(world, clip, "member", range=wanted)
    assert (answer.status_code, answer.content) == (status, part)
    if status == 206:
        begin = FILM.index(part) if len(part) > 7 else len(FILM) - 7
        end = begin + len(part) - 1
        assert answer.headers["content-range"] == f"bytes {begin}-{end}/{len(FILM)}"


def test_children_publish_no_films(world: World, route: str, clip: str) -> None:
    me = world.people["member"].id
    assert me is not None
    assert confirm(world, "member", clip, (0, 1)).is_success
    assert publish(world, clip, of_age=False).status_code == 403
    with world.server.database.writing() as session:
        session.merge(Profile(person_id=me, birth_year=now().year - 15))
    assert publish(world, clip).status_code == 403
    assert announce(world, "member", route, film=True).status_code == 403
    assert announce(world, "member", route).is_success
    assert shown(world, route) == []


def test_a_gym_without_films_shows_none(world: World, route: str, clip: str) -> None:
    published(world, clip)
    assert ask(world, "PATCH", "", "owner", {"features_off": ["films"]}).is_success
    assert shown(world, route) == []
    assert film(world, clip, "judge").status_code == 404
    assert film(world, clip, "member").content == FILM  # one's own
    assert announce(world, "member", route, film=True).status_code == 403


def test_a_reported_film_is_kept_or_removed_by_a_setter(
    world: World, route: str, clip: str
) -> None:
    published(world, clip)
    complaint = {"reason": "my face"}
    for _ in range(2):
        assert ask(world, "PUT", f"/clips/{clip}/film/report", "judge", complaint).is_success
    assert ask(world, "GET", "/film-reports", "judge").status_code == 403
    [report] = ask(world, "GET", "/film-reports", "setter").json()["items"]
    assert (report["clip_id"], report["reason"]) == (clip, "my face")
    assert ask(world, "DELETE", f"/film-reports/{report['id']}", "setter").is_success
    assert ask(world, "GET", "/film-reports", "setter").json()["items"] == []
    assert shown(world, route) == [clip]
    assert ask(world, "DELETE", f"/clips/{clip}/film", "judge").status_code == 403
    assert ask(world, "DELETE", f"/clips/{clip}/film", "setter").is_success
    assert shown(world, route) == []
    assert film(world, clip, "member").status_code == 404
    assert clips(world, "member", route)[0]["confirmed"]  # what was read stays
    tidy(world.server.settings, world.server.database)
    assert f"films/{clip}" not in stored(world)
    with world.server.database.reading() as session:
        logged = select(AuditEntry.action).where(AuditEntry.subject == clip)
        assert list(session.scalars(logged)) == ["film.keep", "film.remove"]


def test_a_film_that_nobody_publishes_goes_after_a_week(
    world: World, route: str, clip: str
) -> None:
    def aged(days: int) -> None:
        with world.server.database.writing() as session:
            change = update(Clip).where(Clip.id == UUID(clip))
            session.execute(change.values(created_at=now() - timedelta(days=days)))
        tidy(world.server.settings, world.server.database)

    aged(6)
    assert f"films/{clip}" in stored(world)
    published(world, clip)
    aged(8)
    assert f"films/{clip}" in stored(world)
    with world.server.database.writing() as session:
        session.get_one(Clip, UUID(clip)).published_at = None
    aged(8)
    assert not clips(world, "member", route)[0]["has_film"]
    aged(8)
    assert f"films/{clip}" not in stored(world)


def test_who_is_banned_or_gone_shows_no_films(world: World, route: str, clip: str) -> None:
    published(world, clip)
    me = world.people["member"].id
    with world.server.database.writing() as session:
        session.add(Ban(gym_id=world.gym.id, person_id=me, reason="rude"))
    assert shown(world, route) == []
    assert film(world, clip, "judge").status_code == 404
    with world.server.database.writing() as session:
        session.delete(session.get_one(Clip, UUID(clip)))
    tidy(world.server.settings, world.server.database)
    assert f"films/{clip}" not in stored(world)
