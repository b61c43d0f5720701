"""The log on a small wall: what each entry does, in its order, once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs
from small_wall import (  # type: ignore[import-not-found]
    LEFT_OUT,
    PLACE,
    SCAN,
    VOLUME,
    after,
    made_scan,
    members,
    ref,
    route,
)

from walltopo.editing.replay import Outcome, replay
from walltopo.scans.edits import (
    Assign,
    Cut,
    Edit,
    Join,
    Keep,
    Leave,
    Merge,
    Paint,
    Ref,
    Remove,
    SetHold,
    SetProblem,
    SetRole,
    SetRoute,
    Share,
    Split,
)
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route

COLUMN = {1: [*range(1, 7)], 2: [*range(11, 17)], 3: [*range(21, 27)]}


def hold(outcome: Outcome, number: int) -> Hold | None:
    return {h.id: h for h in outcome.holds.holds}.get(number)


def route_of(outcome: Outcome, number: int) -> Route:
    return next(row for row in outcome.routes.routes if row.id == number)


def same(one: Outcome, two: Outcome) -> bool:
    """Return whether nothing of two outcomes differs."""
    tables = (one.routes, one.holds, one.notes) == (
        two.routes,
        two.holds,
        two.notes,
    )
    return tables and bool((one.labels == two.labels).all())


def test_no_entry_changes_nothing() -> None:
    found = after([])
    assert found.routes == SCAN.routes
    unrouted = [structs.replace(hold, route=None) for hold in found.holds.holds]
    assert tuple(unrouted) == SCAN.found.holds
    assert [row.id for row in found.holds.left_out] == [LEFT_OUT]
    np.testing.assert_array_equal(found.labels, SCAN.labels)
    assert found.notes == ()


def test_merge_keeps_the_first_id() -> None:
    found = after([Merge(routes=(route(1, 2), route(3, 22)))])
    assert members(found) == {1: COLUMN[1] + COLUMN[3], 2: COLUMN[2]}
    assert route_of(found, 1).ambiguous == ()


def test_split_makes_a_new_route_with_the_id_that_was_requested() -> None:
    found = after([Split(route=route(1, 1), holds=(ref(5), ref(6)), new=4)])
    assert members(found) == {1: [1, 2, 3, 4], 2: COLUMN[2], 3: COLUMN[3], 4: [5, 6]}
    assert not any(row.ambiguous for row in found.routes.routes)
    # An id that is in use, or far away, is not given.
    for wanted in (0, 2, 2**31 - 1):
        found = after([Split(route=route(1, 1), holds=(ref(5),), new=wanted)])
        assert members(found)[4] == [5]


def test_all_entries_together_skip_few_ids() -> None:
    """Tables have a row for each id, so ids that skip further and further take all memory."""
    far = [
        Split(route=route(1, 1), holds=(ref(5),), new=900),
        Split(route=route(1, 1), holds=(ref(6),), new=1_800),
    ]
    found = members(after(far))
    assert (found[900], found[901]) == ([5], [6])


def test_assign_moves_a_hold_or_takes_it_out() -> None:
    found = after(
        [Assign(hold=ref(11), route=route(1, 3)), Assign(hold=ref(12), route=Ref(0, PLACE[12]))]
    )
    assert members(found)[1] == [*COLUMN[1], 11]
    assert members(found)[2] == [13, 14, 15, 16]
    assert found.routes.unrouted == (12,)


def test_what_is_reported_of_a_route() -> None:
    shown = {"name": "The Owl", "grade": "6b+", "setter": "Ada", "description": "Mind the foot."}
    found = after(
        [
            SetRoute(
                route=route(1, 1),
                name=shown["name"],
                grade=shown["grade"],
                setter=shown["setter"],
                description=shown["description"],
                date="2026-03-01",
                colour="blue",
            )
        ]
    )
    row = route_of(found, 1)
    assert {name: getattr(row, name) for name in shown} == shown
    assert (row.date, row.colour) == ("2026-03-01", "blue")
    assert row.colour_rgb == (40, 80, 190), "as blue looks on this wall"
    cleared = [SetRoute(route=route(1, 1), name="Owl"), SetRoute(route=route(1, 1), name="")]
    assert route_of(after(cleared), 1) == SCAN.routes.routes[0]


def test_a_role_is_about_its_own_hold() -> None:
    before = SCAN.routes.routes[0]
    assert (before.start, before.top) == ((1, 2), (6,))
    found = after([SetRole(hold=ref(3), route=route(1, 3), role="start")])
    assert route_of(found, 1).start == (1, 2, 3)
    assert route_of(found, 1).doubtful_start == "", "a setter has said it"
    found = after(
        [
            SetRole(hold=ref(1), route=route(1, 1), role="hand"),
            SetRole(hold=ref(3), route=route(1, 3), role="zone"),
            SetRole(hold=ref(4), route=route(1, 4), role="foot"),
            SetRole(hold=ref(VOLUME), route=route(1, 4), role="top"),
        ]
    )
    row = route_of(found, 1)
    assert (row.start, row.zone, row.footholds, row.top) == ((2,), (3,), (4,), (6, VOLUME))
    assert row.holds == before.holds
    # Only of the route that the hold is in.
    lost = after([SetRole(hold=ref(1), route=route(2, 12), role="top")])
    (note,) = lost.notes
    assert (note.reason, note.numbers[1]) == ("other_route", 2)
    assert "no longer in route 2" in note.text
    assert lost.routes == SCAN.routes


def test_roles_follow_their_holds_through_split_and_merge() -> None:
    start = SetRole(hold=ref(3), route=route(1, 3), role="start")
    split = Split(route=route(1, 3), holds=(ref(3), ref(4)), new=4)
    assert 3 in route_of(after([start, split]), 4).start
    merge = Merge(routes=(route(2, 11), route(1, 3)))
    assert 3 in route_of(after([start, merge]), 2).start
    moved = after([start, Assign(hold=ref(3), route=route(2, 11))])
    assert 3 not in route_of(moved, 2).start


def test_a_hold_is_corrected() -> None:
    found = after([SetHold(hold=ref(2), type="crimp")])
    row = hold(found, 2)
    assert row is not None
    assert (row.type, row.type_confidence, row.review) == ("crimp", 1.0, False)
    assert members(found) == COLUMN
    found = after([SetHold(hold=ref(2), kind="volume")])
    assert found.routes.volumes == (2, VOLUME)
    assert 2 not in members(found)[1]
    found = after([SetHold(hold=ref(VOLUME), kind="hold", colour="red")])
    assert members(found)[3] == [*COLUMN[3], VOLUME]


def test_a_recoloured_hold_goes_where_its_colour_is() -> None:
    found = after([SetHold(hold=ref(12), colour="red")])
    assert 12 in members(found)[1] + members(found)[3]
    row = hold(found, 12)
    assert row is not None
    assert row.colour_rgb == (200, 30, 40)
    pink = after([SetHold(hold=ref(12), colour="pink")])
    assert pink.routes.unrouted == (12,), "no route is pink"
    # The hold stays in the route to which a setter assigned it.
    put = [Assign(hold=ref(12), route=route(2, 13)), SetHold(hold=ref(12), colour="red")]
    assert 12 in members(after(put))[2]


def test_a_hold_with_a_second_colour_may_go_to_the_route_of_either() -> None:
    found = after([SetHold(hold=ref(12), second_colour="red")])
    row = hold(found, 12)
    assert row is not None
    assert row.colours == (row.colour, "red")
    assert row.second_rgb == (200, 30, 40)
    assert 12 in members(found)[2], "a hold stays in a route of one of its colours"
    both = [SetHold(hold=ref(12), colour="pink"), SetHold(hold=ref(12), second_colour="red")]
    assert 12 in members(after(both))[1] + members(after(both))[3]
    one = hold(after([*both, SetHold(hold=ref(12), second_colour="")]), 12)
    assert one is not None
    assert one.colours == ("pink",)
    same = hold(after([*both, SetHold(hold=ref(12), colour="red")]), 12)
    assert same is not None
    assert same.colours == ("red",)


def test_what_is_taken_out_can_be_brought_back() -> None:
    gone = after([Remove(hold=ref(2))])
    assert hold(gone, 2) is None
    assert members(gone)[1] == [1, 3, 4, 5, 6]
    assert [row.left_out for row in gone.holds.left_out if row.id == 2] == ["taken out by hand"]
    back = after([Remove(hold=ref(2)), Keep(hold=ref(2))])
    assert members(back) == COLUMN
    assert [row.id for row in back.holds.left_out] == [LEFT_OUT]


def test_what_the_scan_left_out_can_be_kept() -> None:
    found = after([Keep(hold=ref(LEFT_OUT))])
    assert hold(found, LEFT_OUT) is not None
    assert LEFT_OUT in members(found)[1]
    assert found.holds.left_out == ()


def test_paint_gives_triangles_and_measures_anew() -> None:
    beside = (PLACE[1][0] + 0.12, 0.0, PLACE[1][2])
    found = after([Paint(hold=ref(1), at=beside, radius_m=0.08)])
    near = np.linalg.norm(SCAN.mesh.centroids - beside, axis=1) <= 0.08
    assert (found.labels[near] == 1).all()
    row = hold(found, 1)
    assert row is not None
    assert row.position[0] > PLACE[1][0] + 0.01
    erased = after([Paint(hold=Ref(0, PLACE[1]), at=PLACE[1], radius_m=0.5)])
    assert hold(erased, 1) is None, "nothing is left of it"
    assert 1 not in members(erased)[1]


def test_cut_and_join_undo_each_other() -> None:
    x, _, z = PLACE[3]
    line = ((x - 0.2, 0.0, z + 0.03), (x + 0.2, 0.0, z + 0.03))
    found = after([Cut(hold=ref(3), points=line, new=60)])
    rows = np.flatnonzero(SCAN.labels == 3)
    assert set(found.labels[rows].tolist()) == {3, 60}
    above = SCAN.mesh.centroids[found.labels == 60][:, 2] > z + 0.03
    assert above.all(), "the larger part keeps the id"
    assert members(found)[1] == [*COLUMN[1], 60]
    new = hold(found, 60)
    assert new is not None
    joined = after(
        [
            Cut(hold=ref(3), points=line, new=60),
            Join(holds=(Ref(3, PLACE[3]), Ref(60, new.position))),
        ]
    )
    np.testing.assert_array_equal(joined.labels, SCAN.labels)
    assert members(joined) == COLUMN
    beside = ((x - 0.2, 0.0, z + 0.3), (x + 0.2, 0.0, z + 0.3))
    assert "does not cross" in after([Cut(hold=ref(3), points=beside, new=60)]).notes[0].text


def test_sequences_act_in_their_order() -> None:
    """Edits act in the order of the log, not in an order of their kinds."""
    found = after(
        [
            SetRoute(route=route(3, 21), name="Heron"),
            Merge(routes=(route(3, 21), route(1, 1))),
            Split(route=route(3, 21), holds=(ref(1), ref(2)), new=4),
            SetRoute(route=route(4, 1), name="Owl"),
            Assign(hold=ref(3), route=route(4, 2)),
            Remove(hold=ref(4)),
            Split(route=route(4, 1), holds=(ref(3),), new=5),
        ]
    )
    assert members(found) == {2: COLUMN[2], 3: [5, 6, *COLUMN[3]], 4: [1, 2], 5: [3]}
    assert [row.name for row in found.routes.routes] == ["", "Heron", "Owl", ""]
    assert found.notes == ()


def test_edits_survive_a_rescan_with_other_ids_and_a_small_shift() -> None:
    edits = [
        Merge(routes=(route(1, 2), route(3, 22))),
        SetRoute(route=route(3, 22), name="Owl"),
        Remove(hold=ref(11)),
    ]
    found = after(edits, made_scan(shift=200, moved=0.03))
    assert sorted(map(len, members(found).values())) == [5, 12]
    assert [row.name for row in found.routes.routes if len(row.holds) == 12] == ["Owl"]
    assert found.notes == ()


def test_the_place_decides_before_the_id() -> None:
    def removed(number: int, at: tuple[float, float, float] | None) -> set[int]:
        found = after([Remove(hold=Ref(number, at))])
        return {row.id for row in found.holds.left_out} - {LEFT_OUT}

    x, y, z = PLACE[12]
    assert removed(1, PLACE[12]) == {12}
    assert removed(12, (x + 0.22, y, z)) == {12}
    assert removed(1, (x + 0.22, y, z)) == set()
    assert removed(12, None) == {12}


@pytest.mark.parametrize(
    "edit",
    [
        Remove(hold=Ref(99, (7.5, 0.0, 3.9))),
        Keep(hold=Ref(99, (7.5, 0.0, 3.9))),
        SetHold(hold=Ref(99, (7.5, 0.0, 3.9)), type="jug"),
        SetRole(hold=ref(1), route=Ref(9, (7.5, 0.0, 3.9)), role="top"),
        SetRoute(route=Ref(9, (7.5, 0.0, 3.9)), name="x"),
        Assign(hold=ref(1), route=Ref(9, (7.5, 0.0, 3.9))),
        Assign(hold=ref(VOLUME), route=route(1, 1)),
        Merge(routes=(route(1, 1), route(1, 2))),
        Join(holds=(ref(1), ref(1))),
        Cut(hold=ref(1), points=(PLACE[1], PLACE[1]), new=60),
        Split(route=route(1, 1), holds=(Ref(99, (7.5, 0.0, 3.9)),), new=4),
        Paint(hold=Ref(99, (7.5, 0.0, 3.9)), at=PLACE[1], radius_m=0.1),
    ],
)
def test_an_entry_that_finds_nothing_is_reported_and_changes_nothing(edit: Edit) -> None:
    found = after([edit])
    assert len(found.notes) == 1
    assert found.notes[0].text.startswith("edit 1 (")
    assert found.routes == SCAN.routes
    assert found.holds == after([]).holds
    np.testing.assert_array_equal(found.labels, SCAN.labels)


PROBLEM = SetProblem(
    hands=(ref(2), ref(12), ref(23)),
    start=(ref(2),),
    top=(ref(23),),
    feet=(ref(21),),
    new=4,
    proposed=True,
)


def test_a_problem_shares_holds_and_takes_none_away() -> None:
    found = after([PROBLEM])
    assert members(found) == {**COLUMN, 4: [2, 12, 21, 23]}
    row = route_of(found, 4)
    assert (row.start, row.top, row.footholds) == ((2,), (23,), (21,))
    assert row.proposed
    assert row.colour == "", "its holds have several"
    assert [one.route for one in found.holds.holds if one.id in (2, 12)] == [1, 2]
    # The place of its first hold is another route's: by its id it is meant all the same.
    named = after([PROBLEM, SetRoute(route=Ref(4, PLACE[21]), name="Ladder", proposed=False)])
    assert (route_of(named, 4).name, route_of(named, 4).proposed) == ("Ladder", False)
    assert route_of(named, 3) == SCAN.routes.routes[2]


def test_a_hold_is_shared_and_leaves_again() -> None:
    shared = [
        Share(hold=ref(12), route=route(1, 1)),
        SetRole(hold=ref(12), route=route(1, 1), role="foot"),
    ]
    found = after(shared)
    assert members(found) == {**COLUMN, 1: [*COLUMN[1], 12]}
    assert route_of(found, 1).footholds == (12,)
    assert members(after([*shared, Leave(hold=ref(12), route=route(1, 1))])) == COLUMN
    left = after([Leave(hold=ref(12), route=route(2, 11))])
    assert left.routes.unrouted == (12,)
    gone = after([PROBLEM, *(Leave(hold=ref(k), route=Ref(4)) for k in (2, 12, 21, 23))])
    assert members(gone) == COLUMN, "without a hold it is no route"
    assert [note.reason for note in after([Leave(hold=ref(12), route=route(1, 1))]).notes] == [
        "other_route"
    ]
    removed = after([PROBLEM, Remove(hold=ref(12))])
    assert members(removed)[4] == [2, 21, 23]
    merged = after([PROBLEM, Merge(routes=(route(1, 1), Ref(4)))])
    assert members(merged) == {**COLUMN, 1: [*COLUMN[1], 12, 21, 23]}


HOLDS = st.sampled_from([ref(number) for number in (1, 2, 3, 6, 11, 12, 21, 26, LEFT_OUT, VOLUME)])
ROUTES = st.sampled_from([route(1, 1), route(1, 3), route(2, 12), route(3, 26), Ref(4), Ref(5)])
SOME = st.lists(HOLDS, min_size=1, max_size=3).map(tuple)
AT = st.sampled_from(list(PLACE.values()))
NEW = st.integers(0, 70)
ENTRIES: Any = st.one_of(
    st.builds(
        SetHold,
        hold=HOLDS,
        colour=st.sampled_from([None, "red", "blue", "pink"]),
        kind=st.sampled_from([None, "hold", "volume"]),
    ),
    st.builds(Remove, hold=HOLDS),
    st.builds(Keep, hold=HOLDS),
    st.builds(
        SetRole,
        hold=HOLDS,
        route=ROUTES,
        role=st.sampled_from(["start", "top", "zone", "foot", "hand"]),
    ),
    st.builds(Paint, hold=st.one_of(HOLDS, st.just(Ref(0))), at=AT, radius_m=st.floats(0.01, 0.7)),
    st.builds(Cut, hold=HOLDS, points=st.tuples(AT, AT), new=NEW),
    st.builds(Join, holds=SOME),
    st.builds(Merge, routes=st.lists(ROUTES, min_size=1, max_size=3).map(tuple)),
    st.builds(Split, route=ROUTES, holds=SOME, new=NEW),
    st.builds(Assign, hold=HOLDS, route=st.one_of(ROUTES, st.just(Ref(0)))),
    st.builds(SetProblem, hands=SOME, start=SOME, top=SOME, feet=SOME, new=NEW),
    st.builds(Share, hold=HOLDS, route=ROUTES),
    st.builds(Leave, hold=HOLDS, route=ROUTES),
    st.builds(SetRoute, route=ROUTES, name=st.sampled_from([None, "", "Owl"])),
)


@settings(max_examples=60)
@given(edits=st.lists(ENTRIES, max_size=12))
def test_any_log_leaves_a_scan_that_holds_together(edits: list[Edit]) -> None:
    found = after(edits)
    assert same(found, after(edits)), "the same log gives the same"
    ids = {h.id for h in found.holds.holds}
    out = {row.id for row in found.holds.left_out}
    volumes = set(found.routes.volumes)
    assert not ids & out
    assert set(np.unique(found.labels).tolist()) - {0} <= ids | out
    routed = [number for row in found.routes.routes for number in row.holds]
    shares = any(isinstance(edit, SetProblem | Share) for edit in edits)
    assert shares or len(routed) == len(set(routed)), "a hold is of one route"
    assert all(len(row.holds) == len(set(row.holds)) for row in found.routes.routes)
    assert set(routed) | set(found.routes.unrouted) | volumes == ids
    for row in found.routes.routes:
        assert row.holds
        named = {*row.start, *row.top, *row.zone, *row.footholds}
        assert named <= {*row.holds, *volumes}
    for hold_row in found.holds.holds:
        on = [row.id for row in found.routes.routes if hold_row.id in row.holds]
        assert hold_row.route in on if on else hold_row.route is None


@settings(max_examples=30)
@given(edits=st.lists(ENTRIES, min_size=1, max_size=8))
def test_an_entry_counts_once_and_undo_is_the_log_without_it(edits: list[Edit]) -> None:
    before = after(edits[:-1])
    after(edits)
    assert same(before, after(edits[:-1])), "nothing of an entry stays when it is dropped"
    np.testing.assert_array_equal(SCAN.labels, made_scan().labels)


def test_the_unit_of_the_scan_goes_into_its_table() -> None:
    scan = replace(SCAN, found=structs.replace(SCAN.found, unit=2.5))
    found = replay(scan, ())
    assert found.holds.unit == 2.5
