"""The moves of one's own clip, replayed on the wall beside the suggested ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import UUID

import msgspec
import pytest
from gym.tests.clips.attempts import an_attempt
from gym.tests.clips.sending import confirm, read, sent
from gym.tests.worlds import World, hold

from walltopo.scans.folder import ScanFolder
from walltopo.scans.moves import Moves
from walltopo.scans.routes import Route, Routes
from walltopo_gym.accounts.models import Profile
from walltopo_gym.publishing.moves import SuggestedMoves

HOLDS = [msgspec.structs.replace(hold(n, 0.25 * (n % 2), 0.4 * n), type="jug") for n in range(1, 7)]
CLIMB = [("left hand", 1), ("right hand", 2), ("left hand", 3), ("right foot", 1)]


@pytest.fixture
def scan(world: World) -> UUID:
    """A published ladder of six jugs."""
    made = world.reviewed({}, HOLDS)
    with TemporaryDirectory() as name:
        path = ScanFolder(Path(name)).routes
        Routes(routes=(Route(1, "red", holds=tuple(range(1, 7)), start=(1,), top=(6,)),)).save(path)
        world.server.services.store.put(f"scans/{made}/routes.json", path)
    assert world.publish(made, {"number": 1, "name": "Ladder"}).is_success
    return made


@pytest.fixture
def route(world: World, scan: UUID) -> str:
    rows = world.server.ask("GET", f"{world.path}/routes", world.people["member"]).json()
    return str(rows[0]["id"])


def an_attempt_that_lets_go() -> Any:
    """Two hands on holds; the left one moves, the right one lets go, a foot is set."""
    attempt = an_attempt(CLIMB)
    states = ((1, 0, 0, 0), (1, 2, 0, 0), (3, 2, 0, 0), (3, 0, 0, 1))
    for row, holds in zip(attempt["moves"], states, strict=True):
        row["holds"] = list(holds)
    return attempt


def replay(world: World, clip: str, who: str = "member") -> Any:
    return world.server.ask("GET", f"{world.path}/clips/{clip}/moves.json", world.people[who])


def states(world: World, clip: str) -> list[Sequence[int]]:
    moves = msgspec.json.decode(replay(world, clip).content, type=Moves)
    [own] = [one for one in moves.routes[0].climbers if one.climber == "clip"]
    return [move.holds for move in own.moves]


def test_a_clip_climbs_as_it_was_read(world: World, route: str) -> None:
    clip = read(world, "member", route, an_attempt_that_lets_go())
    assert states(world, clip) == [(1, 0, 0, 0), (1, 2, 0, 0), (3, 2, 0, 0), (3, 0, 0, 1)]


def test_a_confirmed_clip_climbs_as_its_person_says(world: World, route: str) -> None:
    clip = read(world, "member", route, an_attempt_that_lets_go())
    assert confirm(world, "member", clip, (0, 1), (1, 3), (3, 2)).is_success
    # The right hand was at 3, and the left hand did not leave 1.
    assert states(world, clip) == [(1, 0, 0, 0), (1, 3, 0, 0), (1, 0, 0, 2)]


def test_suggested_climbers_follow(world: World, scan: UUID, route: str) -> None:
    clip = read(world, "member", route, an_attempt_that_lets_go())
    assert [one["climber"] for one in replay(world, clip).json()["routes"][0]["climbers"]] == [
        "clip"
    ]
    SuggestedMoves(world.server.database, world.server.services.store).suggest(str(scan))
    climbers = replay(world, clip).json()["routes"][0]["climbers"]
    assert [one["climber"] for one in climbers] == ["clip", "short", "adult", "tall"]
    assert (climbers[0]["height_m"], climbers[0]["reached"]) == (1.75, True)
    member = world.people["member"].id
    with world.server.database.writing() as session:
        session.merge(Profile(person_id=member, height_cm=162, reach_cm=170))
    mine = replay(world, clip).json()["routes"][0]["climbers"][0]
    assert (mine["height_m"], mine["span_m"]) == (1.62, 1.7)


def test_a_clip_is_replayed_by_its_person_alone(world: World, route: str) -> None:
    clip = read(world, "member", route, an_attempt_that_lets_go())
    assert replay(world, clip, "judge").status_code == 404
    assert replay(world, clip, "owner").status_code == 404


def test_a_clip_is_not_replayed_before_it_was_read(world: World, route: str) -> None:
    answer = replay(world, sent(world, "member", route))
    assert (answer.status_code, answer.json()["code"]) == (409, "clip-not-read")
