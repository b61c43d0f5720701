"""Moments at the calendar's edges and huge numbers are refused in words."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import pytest
from gym.tests.competitions.contest import Contest
from gym.tests.worlds import World, hold, make_world

FAR = (
    "0001-01-01T00:00:00+14:00",
    "9999-12-31T23:59:59-12:00",
    "1899-12-31T23:59:59Z",
    "2200-01-01T00:00:00Z",
)


@pytest.mark.parametrize("moment", FAR)
def test_a_moment_outside_the_calendar_is_refused(world: World, moment: str) -> None:
    public = make_world(world.server, world.people, visibility="public")
    contest = Contest(public).make()
    contest.move("open")
    spelled = moment.replace("+", "%2B")
    assert contest.ask("GET", f"/board?at={spelled}", who="nobody").status_code == 422
    body: dict[str, Any] = {
        "name": "Cup",
        "format": "festival",
        "categories": [{"name": "Open"}],
        "rounds": [{"name": "A", "scoring": {"rules": "points"}}],
    }
    ask, setter = public.server.ask, public.people["setter"]
    made = ask("POST", f"{public.path}/competitions", setter, body | {"starts_at": moment})
    assert made.status_code == 422
    tick = {"kind": "top", "tries": 1, "climbed_at": moment, "route_id": str(uuid4())}
    answer = ask("PUT", f"{public.path}/ascents/{uuid4()}", public.people["member"], tick)
    assert answer.status_code == 422


def test_a_huge_revision_is_refused(world: World) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, revision=10**30).status_code == 422
    assert world.publish(scan, revision=2**62).status_code in (409, 422)


@pytest.mark.parametrize("day", ["0001-01-01", "1899-12-31", "2200-01-01", "9999-12-31"])
@pytest.mark.parametrize("field", ["set_on", "strip_on"])
def test_a_day_outside_the_calendar_is_refused(world: World, field: str, day: str) -> None:
    path = f"{world.path}/routes/{uuid4()}"
    answer = world.server.ask("PATCH", path, world.people["setter"], {field: day})
    assert answer.status_code == 422
    assert "1900 to 2199" in answer.text
