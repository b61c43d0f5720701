"""Proposed problems meet a setter's wishes on the present holds."""

from __future__ import annotations

from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from spray import spray_wall  # type: ignore[import-not-found]

from walltopo.core import InputError
from walltopo.scans.edits import SetProblem
from walltopo.scans.routes import Route
from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.model import shipped_model
from walltopo_climb.grades.of_scan import Scale
from walltopo_climb.movement.body import Body
from walltopo_climb.problems.adjust_grade import adjust_grade
from walltopo_climb.problems.edit_entries import problem_entry, tweak_entries
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.rows import Proposal
from walltopo_climb.problems.search import propose
from walltopo_climb.problems.spec import ProblemSpec

SCALE = Scale(shipped_model(), ())
POOL = Pool.of(spray_wall(), 1.0, True)


def test_setting_proposes_what_was_wished_for() -> None:
    found = propose(POOL, ProblemSpec(grade="7A", moves=6), SCALE)
    assert len(found.proposals) == 3
    for one in found.proposals:
        assert one.violations == ()
        assert FONT.index(one.grade.low) <= FONT.index("7A") <= FONT.index(one.grade.high)
        assert one.alike <= 0.5
        assert {*one.start, *one.top} <= {*one.hands}
        assert not {*one.hands} & {*one.feet}
        heights = [POOL.by_id[number].position[2] for number in one.hands]
        assert max(heights) == heights[-1], "it ends at its highest hold"
        by_name = {row.climber: row for row in one.climbers}
        assert by_name["adult"].reached
        # The moves show which body does not get up or has to leap.
        assert set(by_name) == {"child", "short", "adult", "tall"}


@pytest.mark.slow
def test_setting_is_the_same_for_the_same_seed() -> None:
    spec = ProblemSpec(grade="6C", moves=3, count=1, seed=7)
    once = propose(POOL, spec, SCALE)
    assert once == propose(POOL, spec, SCALE)
    assert once.proposals != propose(POOL, replace(spec, seed=8), SCALE).proposals


@pytest.mark.slow
def test_setting_keeps_to_the_style_and_the_body() -> None:
    slopers = propose(POOL, ProblemSpec(grade="7A", holds="slopers", count=1), SCALE).proposals[0]
    own = [POOL.by_id[number].type for number in slopers.hands]
    assert "holds" in slopers.violations or own.count("sloper") >= len(own) / 2
    spec = ProblemSpec(grade="7A", height=1.45, steepness="slab", count=1)
    short = propose(POOL, spec, SCALE).proposals[0]
    (you,) = (row for row in short.climbers if row.climber == "you")
    leaps = [move for move in you.moves if move.beyond > 0]
    assert "body" in short.violations or (you.reached and not leaps)
    assert "steepness" in short.violations, "there is no slab here, and it says so"


def test_setting_says_what_the_model_does_not_know() -> None:
    jugs = tuple(replace(row, type="jug", size=0.2) for row in spray_wall(60, -5.0))
    for one in propose(Pool.of(jugs, 1.0, True), ProblemSpec(grade="4", moves=4), SCALE).proposals:
        assert "easy" in one.violations
        assert one.grade.low == FONT[0], "open below"


def test_setting_refuses_what_is_no_wish() -> None:
    with pytest.raises(InputError, match="not a boulder grade"):
        propose(POOL, ProblemSpec(grade="hard"), SCALE)
    with pytest.raises(InputError, match="arm span"):
        propose(POOL, ProblemSpec(grade="6A", span=2.7), SCALE)
    with pytest.raises(InputError, match="holds for a problem"):
        propose(Pool.of(spray_wall(2), 1.0, True), ProblemSpec(grade="6A"), SCALE)


@settings(max_examples=4, deadline=None)
@given(
    unit=st.floats(0.2, 5.0),
    seed=st.integers(0, 3),
    count=st.integers(8, 25),
    height=st.floats(1.2, 1.95),
)
def test_setting_holds_for_any_wall(unit: float, seed: int, count: int, height: float) -> None:
    rows = spray_wall(count, 5.0 + 10 * seed, seed, unit)
    pool = Pool.of(rows, unit, True)
    if not pool.starts(Body(height)).any():
        return
    found = propose(pool, ProblemSpec(grade="6C-7B", height=height, count=1, moves=4), SCALE)
    for one in found.proposals:
        numbers = {*one.hands, *one.feet}
        assert numbers <= {row.id for row in rows}
        assert all(pool.by_id[number].type != "foothold" for number in one.hands)
        assert next(row for row in one.climbers if row.climber == "adult").reached
        assert abs(one.moves - 4) <= 1 or "moves" in one.violations


@cache
def first() -> Proposal:
    return propose(POOL, ProblemSpec(grade="7A", count=1), SCALE).proposals[0]


def route_of_first() -> Route:
    one = first()
    holds = (*one.hands, *one.feet)
    return Route(3, holds=holds, start=one.start, top=one.top, footholds=one.feet)


@pytest.mark.slow
def test_setting_eases_by_a_hold_that_hangs_near() -> None:
    route = route_of_first()
    other = Route(4, holds=tuple(range(1, 61)))
    found = adjust_grade(POOL, route, [route, other], SCALE, "easier")
    assert found.tweaks
    for tweak in found.tweaks:
        assert tweak.by < 0
        assert tweak.do.startswith("add")
        assert tweak.hold not in route.holds
        assert tweak.on == 4
        assert tweak.crux in route.holds
    off = [abs(tweak.by + 1) for tweak in found.tweaks]
    assert off[0] <= min(off) + 0.5, "the nearest to one grade first, unless another eases the crux"
    for tweak in adjust_grade(POOL, route, [route], SCALE, "harder").tweaks:
        assert tweak.by > 0
        assert tweak.do == "take away"
        assert tweak.hold in {*route.holds} - {*route.start, *route.top}


def test_setting_cannot_ease_what_has_no_way() -> None:
    far = Route(1, holds=(1, 2, 3), start=(1,), top=(1,))
    with pytest.raises(InputError, match="no sequence"):
        adjust_grade(POOL, far, [far], SCALE, "easier")


def test_setting_becomes_entries_of_the_log() -> None:
    one = first()
    entry = problem_entry(one, POOL.by_id)
    assert isinstance(entry, SetProblem)
    assert entry.proposed
    assert [ref.id for ref in entry.hands] == [*one.hands]
    assert all(ref.at == POOL.by_id[ref.id].position for ref in entry.hands)
    route = route_of_first()
    tweak = adjust_grade(POOL, route, [route], SCALE, "easier").tweaks[0]
    kinds = [type(edit).__name__ for edit in tweak_entries(tweak, route, POOL.by_id)]
    assert kinds == ["Share", "SetRole"]
