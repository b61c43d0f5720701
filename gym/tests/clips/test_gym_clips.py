"""Clips: received whole, seen by their person alone, confirmed, and counted together."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from gym.tests.clips.attempts import an_attempt
from gym.tests.clips.sending import (
    TUS,
    VIDEO,
    announce,
    clips,
    confirm,
    read,
    readings,
    send,
    sent,
)
from gym.tests.worlds import World, hold
from sqlalchemy import update

from walltopo_gym.accounts import limits
from walltopo_gym.accounts.limits import Limit
from walltopo_gym.clips import reading
from walltopo_gym.clips.child import Limits, WithdrawnError
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.reader import Found, Phase, ReadRequest, Refused
from walltopo_gym.clips.reading import record_failure, tidy
from walltopo_gym.clock import now
from walltopo_gym.gyms.models import Ban
from walltopo_gym.jobs.queue import Failure
from walltopo_gym.operating.own_data import all_of, delete_account

pytestmark = pytest.mark.both_databases("cascades and counting in SQL")

HOLDS = [hold(n, 0.3 * (n % 2), 0.4 * n) for n in (3, 1, 2, 4)]
CLIMB = [("left hand", 1), ("right hand", 2), ("right foot", 1), ("left hand", 3)]


@pytest.fixture
def route(world: World) -> str:
    """A route of three holds; a fourth hold is beside it."""
    made = world.reviewed({1: [3, 1, 2]}, HOLDS)
    assert world.publish(made, {"number": 1, "name": "Moon"}).is_success
    rows = world.server.ask("GET", f"{world.path}/routes", world.people["member"]).json()
    return str(rows[0]["id"])


def beta(world: World, route: str, who: str = "member") -> Any:
    return world.server.ask("GET", f"{world.path}/routes/{route}/beta", world.people[who]).json()


def videos(world: World) -> list[str]:
    return world.server.services.store.keys("clips/")


def test_a_clip_arrives_in_pieces_and_is_queued_once(world: World, route: str) -> None:
    answer = announce(world, "member", route)
    clip = str(answer.headers["location"]).rpartition("/")[2]
    assert answer.headers["upload-offset"] == "0"
    assert send(world, "member", clip, 0, VIDEO[:50]).headers["upload-offset"] == "50"
    assert send(world, "member", clip, 0, VIDEO[50:]).status_code == 409
    again = announce(world, "member", route)  # in another tab
    assert (again.headers["location"], again.headers["upload-offset"]) == (
        answer.headers["location"],
        "50",
    )
    path = f"{world.path}/clips/{clip}"
    assert world.server.ask("HEAD", path, world.people["judge"], headers=TUS).status_code == 404
    assert send(world, "member", clip, 50, VIDEO[50:]).status_code == 204
    assert [one["state"] for one in clips(world, "member", route)] == ["sent"]
    assert clips(world, "judge", route) == []
    assert world.server.services.store.read(f"clips/{clip}") == VIDEO
    whole = announce(world, "member", route)
    assert whole.headers["upload-offset"] == str(len(VIDEO))


def test_a_clip_whose_server_was_killed_after_its_last_byte_is_queued(
    world: World, route: str
) -> None:
    clip = str(announce(world, "member", route).headers["location"]).rpartition("/")[2]
    world.server.incoming.beside("clips").path(UUID(clip)).write_bytes(VIDEO)
    path = f"{world.path}/clips/{clip}"
    answer = world.server.ask("HEAD", path, world.people["member"], headers=TUS)
    assert answer.headers["upload-offset"] == str(len(VIDEO))
    assert [one["state"] for one in clips(world, "member", route)] == ["sent"]


def test_what_is_no_clip_is_refused(
    world: World, route: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert announce(world, "member", route, "a.jpg").json()["code"] == "clip-no-video"
    assert announce(world, "member", route, size=2_000_000_000).json()["code"] == "clip-too-large"
    clip = str(announce(world, "member", route).headers["location"]).rpartition("/")[2]
    other = send(world, "member", clip, 0, VIDEO[::-1])
    assert (other.status_code, other.json()["code"]) == (422, "clip-other-content")
    assert clips(world, "member", route) == []
    path = f"{world.path}/walls/{world.wall.id}/routes"
    made = world.server.ask("POST", path, world.owner, {"routes": [{"name": "By hand"}]})
    unplaced = announce(world, "member", made.json()[0]["id"])
    assert unplaced.json()["code"] == "clip-no-scan"
    monkeypatch.setattr(limits, "_CLIPS", Limit("clip", 1, 86400))
    assert announce(world, "member", route).status_code == 429
    judge = world.people["judge"].id
    with world.server.database.writing() as session:
        session.add(Ban(gym_id=world.gym.id, person_id=judge, reason=""))
    assert announce(world, "judge", route).status_code == 403


def test_a_confirmed_sequence_is_what_was_read_or_corrected(world: World, route: str) -> None:
    clip = sent(world, "member", route)
    assert confirm(world, "member", clip, (0, 1)).json()["code"] == "clip-not-read"
    path = f"{world.path}/clips/{clip}"
    assert world.server.ask("DELETE", path, world.people["member"]).is_success
    clip = read(world, "member", route, an_attempt(CLIMB))
    [shown] = clips(world, "member", route)
    assert [(move["limb"], move["hold"]) for move in shown["attempt"]["moves"]] == CLIMB
    assert (shown["attempt"]["holds"], shown["confirmed"]) == ([1, 2, 3], None)
    for moves, code in (
        ([(1, 2), (1, 2)], "clip-move-unknown"),
        ([(9, 2)], "clip-move-unknown"),
        ([(0, 4)], "clip-hold-unknown"),
    ):
        assert confirm(world, "member", clip, *moves).json()["code"] == code
    assert confirm(world, "judge", clip, (0, 1)).status_code == 404
    done = confirm(world, "member", clip, (0, 2), (3, 3))
    assert done.status_code == 200, done.text
    assert [(one["limb"], one["hold"], one["time_s"]) for one in done.json()["confirmed"]] == [
        ("left hand", 2, 0.0),
        ("left hand", 3, 3.0),
    ]
    ascents = world.server.ask("GET", "/me/data", world.people["member"]).json()["ascents"]
    assert ascents == []


def test_moves_after_the_top_belong_to_no_attempt(world: World, route: str) -> None:
    clip = read(world, "member", route, an_attempt(CLIMB) | {"top_s": 2.0})
    [shown] = clips(world, "member", route)
    assert [(move["limb"], move["hold"]) for move in shown["attempt"]["moves"]] == CLIMB[:3]
    assert confirm(world, "member", clip, (3, 3)).json()["code"] == "clip-move-unknown"


def test_sequences_show_together_from_three_climbers_on(world: World, route: str) -> None:
    everything = [(number, hold) for number, (_, hold) in enumerate(CLIMB)]
    for who in ("member", "judge"):
        confirm(world, who, read(world, who, route, an_attempt(CLIMB)), *everything)
    empty: dict[str, Any] = {"climbers": None, "holds": [], "orders": [], "ends": []}
    assert beta(world, route) == empty
    unconfirmed = read(world, "setter", route, an_attempt(CLIMB[:2], top=False))
    assert beta(world, route) == empty
    confirm(world, "setter", unconfirmed, *everything[:2])
    found = beta(world, route)
    assert found["climbers"] == 3
    assert [(one["number"], one["hold"], one["climbers"]) for one in found["holds"]] == [
        (1, 1, 3),
        (2, 2, 3),
        (3, 3, 2),
    ]
    orders = [
        (order["climbers"], [(one["hand"], one["number"]) for one in order["moves"]])
        for order in found["orders"]
    ]
    assert orders == [
        (2, [("left", 1), ("right", 2), ("left", 3)]),
        (1, [("left", 1), ("right", 2)]),
    ]
    assert [(one["hold"], one["attempts"]) for one in found["ends"]] == [(None, 2), (2, 1)]
    path = f"{world.path}/clips/{unconfirmed}"
    assert world.server.ask("DELETE", path, world.people["setter"]).status_code == 204
    assert beta(world, route) == empty


def test_orders_that_differ_in_one_move_of_ten_count_together(world: World, route: str) -> None:
    long = [(("left hand", "right hand")[k % 2], 1 + k % 3) for k in range(12)]
    odd, other = [*long], [*long[::-1]]
    odd[5] = ("right hand", 4)
    for who, climb in (("member", long), ("judge", odd), ("setter", other)):
        everything = [(number, hold) for number, (_, hold) in enumerate(climb)]
        confirm(world, who, read(world, who, route, an_attempt(climb)), *everything)
    orders = beta(world, route)["orders"]
    assert [order["climbers"] for order in orders] == [2, 1]


@pytest.mark.parametrize(
    ("outcome", "state", "fault"),
    [
        (Found(an_attempt(CLIMB), [1, 2, 3]), "read", ""),
        (Refused("other-wall"), "unreadable", "other-wall"),
    ],
)
def test_the_video_goes_whatever_comes_of_it(
    world: World, route: str, monkeypatch: pytest.MonkeyPatch, outcome: Any, state: str, fault: str
) -> None:
    clip = sent(world, "member", route)
    shown: list[Any] = []

    def read_it(request: ReadRequest, limits: Limits, report: Callable[[Phase], bool]) -> Any:
        assert Path(request.video).read_bytes() == VIDEO
        assert (request.route, report(Phase("frames", 30, 100))) == (1, True)
        shown.extend(clips(world, "member", route))
        return outcome

    monkeypatch.setattr(reading, "download_wall", lambda *_: None)
    monkeypatch.setattr(reading, "read_in_child", read_it)
    readings(world).read(clip)
    [during] = shown
    assert [during[name] for name in ("state", "phase", "done", "total")] == [
        "reading", "frames", 30, 100,
    ]  # fmt: skip
    [after] = clips(world, "member", route)
    assert (after["state"], after["fault"]) == (state, fault)
    assert f"clips/{clip}" not in videos(world)


def test_a_clip_that_is_deleted_while_it_is_read_is_gone(
    world: World, route: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = sent(world, "member", route)

    def read_it(request: ReadRequest, limits: Limits, report: Callable[[Phase], bool]) -> Any:
        path = f"{world.path}/clips/{clip}"
        assert world.server.ask("DELETE", path, world.people["member"]).is_success
        assert not report(Phase("wall"))
        raise WithdrawnError

    monkeypatch.setattr(reading, "download_wall", lambda *_: None)
    monkeypatch.setattr(reading, "read_in_child", read_it)
    readings(world).read(clip)
    assert clips(world, "member", route) == []
    assert f"clips/{clip}" not in videos(world)


def test_after_the_last_failure_the_video_goes(world: World, route: str) -> None:
    clip = sent(world, "member", route)
    for at, state in ((now(), "sent"), (None, "unreadable")):
        failure = Failure("no store", "no store", 1 if at else 2, at)
        with world.server.database.writing() as session:
            record_failure(session, failure, clip)
        assert clips(world, "member", route)[0]["state"] == state
    assert clips(world, "member", route)[0]["fault"] == "failed"
    assert sent(world, "member", route) != clip  # the same video is read anew
    readings(world).read(clip)
    assert f"clips/{clip}" not in videos(world)


def test_a_deleted_account_leaves_no_clip(world: World, route: str) -> None:
    clip = read(world, "member", route, an_attempt(CLIMB))
    me = world.people["member"].id
    assert me is not None
    with world.server.database.reading() as session:
        [row] = all_of(session, me)["clips"]
        assert str(row["id"]) == clip
    with world.server.database.writing() as session:
        delete_account(session, me)
    readings(world).read(clip)
    assert f"clips/{clip}" not in videos(world)
    with world.server.database.reading() as session:
        assert session.get(Clip, UUID(clip)) is None


def test_what_no_clip_waits_for_is_deleted(world: World, route: str) -> None:
    kept = sent(world, "judge", route)
    world.server.services.store.put("clips/nobody", b"old")
    given_up = str(announce(world, "member", route).headers["location"]).rpartition("/")[2]
    send(world, "member", given_up, 0, VIDEO[:9])
    with world.server.database.writing() as session:
        old = update(Clip).where(Clip.id == UUID(given_up))
        session.execute(old.values(created_at=now() - timedelta(days=2)))
    tidy(world.server.settings, world.server.database)
    assert "clips/nobody" not in videos(world)
    assert f"clips/{kept}" in videos(world)
    assert clips(world, "member", route) == []
    assert world.server.incoming.beside("clips").offset(UUID(given_up)) == 0
