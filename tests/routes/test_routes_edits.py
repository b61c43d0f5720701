"""A setter's corrections: applied on every run, found again by their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from walltopo.core import Mesh, Silent
from walltopo.core.files import read_json, write_json
from walltopo.meshes.ply import write_ply
from walltopo.routes.contract import RoutesSettings
from walltopo.routes.edits import apply_hold_edits, find_hold
from walltopo.routes.stage import find_routes, run
from walltopo.scans.attributes import Hold
from walltopo.scans.edits import write_route_edits
from walltopo.scans.folder import ScanFolder


def wall() -> Mesh:
    corners = np.array([[0, 0, 0], [8, 0, 0], [8, 0, 4], [0, 0, 4]], dtype=float)
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))


def column(x: float, colour: str, first: int) -> list[Hold]:
    return [
        Hold(first + k, "hold", (x, 0.0, 0.4 + 0.45 * k), colour=colour, size_m=0.15)
        for k in range(6)
    ]


HOLDS = [*column(1.0, "red", 1), *column(5.0, "red", 11), *column(3.0, "blue", 21)]
PLACE = {hold.id: list(hold.position) for hold in HOLDS}


def routes_with(
    edits: Mapping[str, object], holds: list[Hold] | None = None
) -> dict[int, list[int]]:
    routes, _ = find_routes(wall(), holds or HOLDS, RoutesSettings(), edits=edits)
    return {route.id: sorted(route.holds) for route in routes}


def test_without_edits_there_are_three_routes_from_left_to_right() -> None:
    found = routes_with({})
    assert found == {1: [1, 2, 3, 4, 5, 6], 2: [*range(21, 27)], 3: [*range(11, 17)]}


def test_merge_keeps_the_first_id() -> None:
    edits = {"merge": [{"routes": [1, 3], "at": [PLACE[2], PLACE[12]]}]}
    assert routes_with(edits) == {1: [*range(1, 7), *range(11, 17)], 2: [*range(21, 27)]}


def test_split_makes_a_new_route_and_nothing_of_it_is_ambiguous() -> None:
    edits = {"split": [{"route": 1, "holds": [5, 6], "at": [PLACE[5], PLACE[6]]}]}
    assert routes_with(edits)[4] == [5, 6]
    assert routes_with(edits)[1] == [1, 2, 3, 4]
    routes, _ = find_routes(wall(), HOLDS, RoutesSettings(), edits=edits)
    assert all(not route.ambiguous for route in routes)


def test_assign_moves_a_hold_or_takes_it_out() -> None:
    edits = {
        "assign": [
            {"hold": 21, "at": PLACE[21], "route": 1, "route_at": PLACE[3]},
            {"hold": 22, "at": PLACE[22], "route": 0},
        ]
    }
    found = routes_with(edits)
    assert 21 in found[1]
    assert found[2] == [23, 24, 25, 26]


def test_rename_and_colour() -> None:
    edits = {
        "rename": [{"route": 1, "at": PLACE[1], "name": "The Owl"}],
        "colour": [{"route": 1, "at": PLACE[1], "colour": "crimson"}],
    }
    routes, _ = find_routes(wall(), HOLDS, RoutesSettings(), edits=edits)
    assert (routes[0].name, routes[0].colour) == ("The Owl", "crimson")


def test_edits_survive_a_rescan_with_other_ids_and_a_small_shift() -> None:
    again = [
        replace(hold, id=200 - hold.id, position=(x + 0.03, y, z - 0.02))
        for hold in HOLDS
        for x, y, z in [hold.position]
    ]
    edits = {"merge": [{"routes": [1, 3], "at": [PLACE[2], PLACE[12]]}]}
    found = routes_with(edits, again)
    assert sorted(map(len, found.values())) == [6, 12]


def test_edits_of_what_is_gone_are_told_and_change_nothing() -> None:
    class Notes(Silent):
        def __init__(self) -> None:
            self.lines: list[str] = []

        def note(self, message: str) -> None:
            self.lines.append(message)

    notes = Notes()
    edits = {"assign": [{"hold": 99, "at": [7.5, 0.0, 3.9], "route": 1}]}
    routes, _ = find_routes(wall(), HOLDS, RoutesSettings(), edits=edits, progress=notes)
    assert len(routes) == 3
    assert any("hold 99" in line for line in notes.lines)


def test_the_place_decides_before_the_id() -> None:
    assert find_hold(HOLDS, PLACE[12], 1, 1.0) is HOLDS[7]
    near = [PLACE[12][0] + 0.22, 0.0, PLACE[12][2]]
    assert find_hold(HOLDS, near, 12, 1.0) is HOLDS[7]
    assert find_hold(HOLDS, near, 1, 1.0) is None


def test_hold_edits() -> None:
    edits = [
        {"id": 1, "at": PLACE[1], "colour": "pink", "type": "jug"},
        {"id": 2, "at": PLACE[2], "deleted": True},
        {"id": 3, "at": PLACE[3], "class": "volume"},
        {"id": 77, "at": [0.0, 5.0, 0.0], "deleted": True},
    ]
    holds, lost = apply_hold_edits(HOLDS, edits, 1.0)
    by_id = {hold.id: hold for hold in holds}
    assert (by_id[1].colour, by_id[1].type, by_id[1].colour_confidence) == ("pink", "jug", 1.0)
    assert 2 not in by_id
    assert by_id[3].role == "volume"
    assert len(lost) == 1


def test_stage_applies_the_file_on_every_run(tmp_path: Path) -> None:
    scan = ScanFolder(tmp_path)
    write_ply(scan.mesh, wall())
    write_json(scan.attributes, {"version": 1, "instances": [hold.to_json() for hold in HOLDS]})
    write_route_edits(
        scan.route_edits, {"rename": [{"route": 2, "at": PLACE[21], "name": "Blue moon"}]}
    )
    for _ in range(2):
        run(scan, RoutesSettings(), Silent())
        assert read_json(scan.routes)["routes"][1]["name"] == "Blue moon"
