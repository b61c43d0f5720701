"""Ascents are grouped into sessions and worth points, without a database."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from itertools import pairwise
from uuid import UUID
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.scales import FRENCH, SCALES, UIAA, V_SCALE
from walltopo_gym.climbing.points import BEST, best_of, worth_of
from walltopo_gym.climbing.visits import PAUSE, Event, Sort, visits
from walltopo_gym.gyms.days import day_begins, gym_day

PRAGUE = ZoneInfo("Europe/Prague")
ZONES = st.sampled_from(["UTC", "Europe/Prague", "America/St_Johns", "Asia/Kolkata"]).map(ZoneInfo)
MINUTES = st.integers(0, 3 * 24 * 60)
# The last Sunday of March and of October, when clocks are put on and back, lie within.
STARTS = st.sampled_from([datetime(2026, 3, 28, tzinfo=UTC), datetime(2026, 10, 24, tzinfo=UTC)])


def at(day: int, hour: int, minute: int = 0) -> datetime:
    return datetime(2026, 3, day, hour, minute, tzinfo=PRAGUE)


def ascents(*moments: datetime) -> list[Event]:
    return [Event(moment, Sort.ASCENT, UUID(int=n)) for n, moment in enumerate(moments)]


def sizes(events: list[Event]) -> list[int]:
    return [len(visit.ascents) for visit in visits(events, PRAGUE)]


def test_a_pause_of_four_hours_begins_another_session() -> None:
    assert sizes(ascents(at(2, 10), at(2, 11), at(2, 14, 59), at(2, 19))) == [3, 1]


def test_an_evening_past_midnight_is_one_and_the_day_begins_at_four() -> None:
    late = ascents(at(2, 23), at(3, 1), at(3, 3, 59), at(3, 4, 1))
    assert sizes(late) == [3, 1]
    assert str(visits(late, PRAGUE)[0].day) == "2026-03-02"


def test_marks_by_hand_part_what_is_one_otherwise() -> None:
    events = ascents(at(2, 10), at(2, 11), at(2, 12))
    start = Event(at(2, 10, 30), Sort.START, UUID(int=90))
    end = Event(at(2, 11, 30), Sort.END, UUID(int=91))
    assert sizes([*events, start]) == [1, 2]
    assert sizes([*events, end]) == [2, 1]
    assert visits([*events, end], PRAGUE)[0].closed
    # An end that comes to nothing ends nothing; a start alone is a session that is empty yet.
    assert sizes([Event(at(2, 20), Sort.END, UUID(int=92))]) == []
    assert sizes([start]) == [0]


@given(st.lists(st.tuples(MINUTES, st.sampled_from(list(Sort))), max_size=25), ZONES, STARTS)
def test_sessions_are_whole_apart_and_the_same_in_any_order(
    answer: list[tuple[int, Sort]], zone: ZoneInfo, start: datetime
) -> None:
    events = [
        Event(start + timedelta(minutes=minute), sort, UUID(int=n))
        for n, (minute, sort) in enumerate(answer)
    ]
    found = visits(events, zone)
    assert visits(reversed(events), zone) == found
    when = {event.id: event.at for event in events if event.sort == Sort.ASCENT}
    assert sorted(key for visit in found for key in visit.ascents) == sorted(when)
    for visit in found:
        assert {gym_day(when[key], zone) for key in visit.ascents} <= {visit.day}
        # A session is what lies between its ends: nothing of another one does.
        within = {key for key, at_ in when.items() if visit.began_at <= at_ <= visit.ended_at}
        assert within == set(visit.ascents)
        moments = sorted(when[key] for key in visit.ascents)
        assert all(b - a < PAUSE for a, b in pairwise(moments))


@given(MINUTES, ZONES, STARTS)
def test_a_moment_lies_in_its_day(minute: int, zone: ZoneInfo, start: datetime) -> None:
    moment = start + timedelta(minutes=minute)
    day = gym_day(moment, zone)
    assert day_begins(day, zone) <= moment < day_begins(day + timedelta(days=1), zone)


@pytest.mark.parametrize(
    ("kind", "grades", "label", "points"),
    [
        ("", [], "", 100),
        ("font", [{"label": g} for g in FONT], "6A", 200),
        ("font", [{"label": g} for g in FONT], "7A", 320),
        ("font", [{"label": "6A+/6B"}], "6A+/6B", 230),
        ("font", [{"label": "5C"}], "5C", 180),
        ("v", [{"label": g} for g in V_SCALE], "V3", 200),
        ("v", [{"label": "V3-4"}], "V3-4", 220),
        ("french", [{"label": g} for g in FRENCH], "6a", 200),
        ("uiaa", [{"label": g} for g in UIAA], "VI+", 200),
        ("own", [{"label": "6a"}, {"label": "6b"}], "6a", 120),
        ("circuits", [{"label": "Blue", "low": "6A", "high": "6B+"}], "Blue", 230),
        ("own", [{"label": "easy"}, {"label": "middle"}, {"label": "hard"}], "middle", 260),
        ("own", [{"label": "one"}], "one", 260),
        ("own", [{"label": "easy"}], "gone since", 100),
    ],
)
def test_what_a_top_is_worth(
    kind: str, grades: list[dict[str, str]], label: str, points: int
) -> None:
    assert worth_of(kind, grades, label) == points


@pytest.mark.parametrize("kind", SCALES)
def test_harder_is_never_worth_less(kind: str) -> None:
    scale = SCALES[kind].labels
    worths = [worth_of(kind, [{"label": g} for g in scale], grade) for grade in scale]
    assert worths == sorted(worths)


@given(st.lists(st.integers(100, 500), max_size=30))
def test_the_best_ten_count(values: list[int]) -> None:
    assert best_of(values) == sum(sorted(values)[-BEST:])
