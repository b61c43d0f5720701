"""A setter's corrections: applied on every run, found again by their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from flat_wall import METRES  # type: ignore[import-not-found]
from msgspec.structs import replace

from walltopo.core import Mesh, Silent
from walltopo.holds.edits import apply_hold_edits
from walltopo.meshes.ply import write_ply
from walltopo.pipeline.runner import run_stage
from walltopo.routes.contract import RoutesSettings
from walltopo.routes.stage import find_routes
from walltopo.scans.attributes import Attributes, Hold
from walltopo.scans.folder import ScanFolder
from walltopo.scans.old_edits import (
    Assign,
    HoldEdit,
    Merge,
    Recolour,
    Rename,
    RouteEdits,
    Split,
    find_hold,
)
from walltopo.scans.routes import Routes

BY_NAME = RoutesSettings(link="colour")


def wall() -> Mesh:
    corners = np.array([[0, 0, 0], [8, 0, 0], [8, 0, 4], [0, 0, 4]], dtype=float)
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))


def column(x: float, colour: str, first: int) -> list[Hold]:
    return [
        Hold(first + k, "hold", position=(x, 0.0, 0.4 + 0.45 * k), colour=colour, size=0.15)
        for k in range(6)
    ]


HOLDS = [*column(1.0, "red", 1), *column(5.0, "red", 11), *column(3.0, "blue", 21)]
PLACE = {hold.id: hold.position for hold in HOLDS}


def routes_with(edits: RouteEdits, holds: list[Hold] | None = None) -> dict[int, list[int]]:
    routes, _ = find_routes(wall(), holds or HOLDS, BY_NAME, edits=edits)
    return {route.id: sorted(route.holds) for route in routes}


def test_without_edits_there_are_three_routes_from_left_to_right() -> None:
    found = routes_with(RouteEdits())
    assert found == {1: [1, 2, 3, 4, 5, 6], 2: [*range(21, 27)], 3: [*range(11, 17)]}


def test_merge_keeps_the_first_id() -> None:
    edits = RouteEdits(merge=(Merge(routes=(1, 3), at=(PLACE[2], PLACE[12])),))
    assert routes_with(edits) == {1: [*range(1, 7), *range(11, 17)], 2: [*range(21, 27)]}


def test_split_makes_a_new_route_and_nothing_of_it_is_ambiguous() -> None:
    edits = RouteEdits(split=(Split(route=1, holds=(5, 6), at=(PLACE[5], PLACE[6])),))
    assert routes_with(edits)[4] == [5, 6]
    assert routes_with(edits)[1] == [1, 2, 3, 4]
    routes, _ = find_routes(wall(), HOLDS, BY_NAME, edits=edits)
    assert all(not route.ambiguous for route in routes)


def test_assign_moves_a_hold_or_takes_it_out() -> None:
    edits = RouteEdits(
        assign=(
            Assign(hold=21, at=PLACE[21], route=1, route_at=PLACE[3]),
            Assign(hold=22, at=PLACE[22], route=0),
        )
    )
    found = routes_with(edits)
    assert 21 in found[1]
    assert found[2] == [23, 24, 25, 26]


def test_rename_and_colour() -> None:
    edits = RouteEdits(
        rename=(Rename(route=1, at=PLACE[1], name="The Owl"),),
        colour=(Recolour(route=1, at=PLACE[1], colour="crimson"),),
    )
    routes, _ = find_routes(wall(), HOLDS, BY_NAME, edits=edits)
    assert (routes[0].name, routes[0].colour) == ("The Owl", "crimson")


def test_edits_survive_a_rescan_with_other_ids_and_a_small_shift() -> None:
    again = [
        replace(hold, id=200 - hold.id, position=(x + 0.03, y, z - 0.02))
        for hold in HOLDS
        for x, y, z in [hold.position]
    ]
    edits = RouteEdits(merge=(Merge(routes=(1, 3), at=(PLACE[2], PLACE[12])),))
    found = routes_with(edits, again)
    assert sorted(map(len, found.values())) == [6, 12]


def test_edits_of_what_is_gone_are_told_and_change_nothing() -> None:
    class Notes(Silent):
        def __init__(self) -> None:
            self.lines: list[str] = []

        def note(self, message: str) -> None:
            self.lines.append(message)

    notes = Notes()
    edits = RouteEdits(assign=(Assign(hold=99, at=(7.5, 0.0, 3.9), route=1),))
    routes, _ = find_routes(wall(), HOLDS, BY_NAME, edits=edits, progress=notes)
    assert len(routes) == 3
    assert any("hold 99" in line for line in notes.lines)


def test_the_place_decides_before_the_id() -> None:
    assert find_hold(HOLDS, PLACE[12], 1, 1.0) is HOLDS[7]
    near = [PLACE[12][0] + 0.22, 0.0, PLACE[12][2]]
    assert find_hold(HOLDS, near, 12, 1.0) is HOLDS[7]
    assert find_hold(HOLDS, near, 1, 1.0) is None


def test_hold_edits() -> None:
    edits = [
        HoldEdit(id=1, at=PLACE[1], colour="pink", type="jug"),
        HoldEdit(id=2, at=PLACE[2], deleted=True),
        HoldEdit(id=3, at=PLACE[3], kind="volume"),
        HoldEdit(id=77, at=(0.0, 5.0, 0.0), deleted=True),
    ]
    holds, lost = apply_hold_edits(HOLDS, edits, 1.0)
    by_id = {hold.id: hold for hold in holds}
    assert (by_id[1].colour, by_id[1].type, by_id[1].colour_confidence) == ("pink", "jug", 1.0)
    assert 2 not in by_id
    assert by_id[3].role == "volume"
    assert len(lost) == 1


def test_a_corrected_colour_brings_the_hold_into_its_route() -> None:
    """Routes go by paint: the hold gets the paint of those that are called so."""
    red, blue = (200, 30, 40), (40, 80, 190)
    near = [replace(h, colour="red", colour_rgb=red) for h in column(1.0, "", 1)]
    beside = [replace(h, colour="blue", colour_rgb=blue) for h in column(1.4, "", 21)]
    taken = replace(near[3], colour="blue", colour_rgb=blue)
    seen = [*near[:3], taken, *near[4:], *beside]

    def route_of(holds: list[Hold]) -> set[int]:
        routes, _ = find_routes(wall(), holds, RoutesSettings())
        return next((set(route.holds) for route in routes if taken.id in route.holds), set())

    assert not route_of(seen) & {1, 2, 3, 5, 6}
    holds, _ = apply_hold_edits(seen, [HoldEdit(id=4, at=taken.position, colour="red")], 1.0)
    assert route_of(holds) == {hold.id for hold in near}


def test_stage_applies_the_file_on_every_run(tmp_path: Path) -> None:
    scan = ScanFolder(tmp_path)
    write_ply(scan.mesh, wall())
    METRES.save(scan.scale)
    Attributes(instances=tuple(HOLDS)).save(scan.attributes)
    named = Rename(route=2, at=PLACE[21], name="Blue moon")
    RouteEdits(rename=(named,)).save(scan.route_edits)
    for _ in range(2):
        run_stage(scan, "routes", BY_NAME)
        assert Routes.load(scan.routes).routes[1].name == "Blue moon"
