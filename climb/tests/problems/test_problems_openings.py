"""A hold in the gap of a ladder opens it to shorter climbers."""

from __future__ import annotations

from climb.tests.movement.test_movement_reach import ladder
from msgspec.structs import replace

from walltopo_climb.movement.reach import HEIGHTS, reaching_heights
from walltopo_climb.problems.openings import find_openings
from walltopo_climb.problems.pool import Pool


def test_the_missing_rung_opens_a_ladder_to_children() -> None:
    route, holds = ladder(0.35, rungs=8)
    gapped = replace(route, holds=tuple(n for n in route.holds if n not in (4, 5, 6)))
    before = min(reaching_heights(gapped, holds, 1.0) or (), default=9.0)
    assert before > HEIGHTS[0]
    found = find_openings(Pool.of(holds, 1.0, True), gapped)
    assert found
    assert {one.hold for one in found} <= {4, 5, 6}
    for one in found:
        feet = (*gapped.footholds, one.hold) if one.foot else gapped.footholds
        wider = replace(gapped, holds=(*gapped.holds, one.hold), footholds=feet)
        assert min(reaching_heights(wider, holds, 1.0) or ()) == one.height < before


def test_a_ladder_for_everybody_needs_no_hold() -> None:
    route, holds = ladder(0.35)
    assert find_openings(Pool.of(holds, 1.0, True), route) == ()
