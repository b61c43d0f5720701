"""Downclimb holds without a role from palette or classifier."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from walltopo.describe.classify.attributes import downclimb_colours, with_downclimbs
from walltopo.scans.holds import Hold


def wall(unit: float = 1.0) -> list[Hold]:
    """A red and a blue route, and three large grey jugs far apart."""
    holds: list[Hold] = []
    for number in range(8):
        kind = ("jug", "crimp", "foothold", "unknown")[number % 4]
        for colour, x in (("red", 1.0), ("blue", 4.0)):
            place = (x * unit, 0.0, (0.4 + 0.4 * number) * unit)
            holds.append(Hold(len(holds) + 1, "hold", position=place, colour=colour, type=kind))
    holds = [replace(hold, size=0.12 * unit) for hold in holds]
    for x in (0.0, 3.0, 6.0):
        place = (x * unit, 0.0, 2.0 * unit)
        jug = Hold(len(holds) + 1, "hold", position=place, colour="grey", type="jug")
        holds.append(replace(jug, size=0.2 * unit))
    return holds


@pytest.mark.parametrize("unit", [1.0, 7.0])
def test_few_large_scattered_jugs_are_to_climb_down_by(unit: float) -> None:
    holds, colours = with_downclimbs(wall(unit), unit)
    assert colours == ["grey"]
    assert {hold.role for hold in holds if hold.colour == "grey"} == {"downclimb"}
    assert {hold.role for hold in holds if hold.colour != "grey"} == {"hold"}


def changed(**changes: object) -> list[Hold]:
    return [replace(h, **changes) if h.colour == "grey" else h for h in wall()]


def test_what_makes_a_colour_a_route() -> None:
    assert downclimb_colours(changed(size=0.06), 1.0) == []  # small
    assert downclimb_colours(changed(type="unknown"), 1.0) == []  # not known to be jugs
    crimps = [replace(h, type="crimp") if h.id in (17, 18) else h for h in wall()]
    assert downclimb_colours(crimps, 1.0) == []
    assert downclimb_colours([h for h in wall() if h.id not in (18, 19)], 1.0) == []  # one hold
    column = [
        Hold(100 + k, "hold", position=(8.0, 0, 0.5 * k), colour="grey", type="jug", size=0.2)
        for k in range(6)
    ]
    assert downclimb_colours([*wall(), *column], 1.0) == []


def test_one_jug_of_three_may_be_taken_for_another_type() -> None:
    crimp = [replace(h, type="crimp") if h.id == 17 else h for h in wall()]
    assert downclimb_colours(crimp, 1.0) == ["grey"]


def test_volumes_and_walls_without_holds_do_not_matter() -> None:
    assert downclimb_colours([], 1.0) == []
    volumes = [replace(h, kind="volume", role="volume") for h in changed() if h.colour == "grey"]
    assert downclimb_colours(volumes, 1.0) == []
