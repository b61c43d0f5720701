"""Inventory, and which hold of one scan is which of another."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from walltopo.cli import main
from walltopo.describe.matching.holds import match_holds
from walltopo.describe.matching.inventory import changes, count_holds, size_class, to_csv
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.scale import Scale


def some_holds(count: int, seed: int = 0) -> list[Hold]:
    rng = np.random.default_rng(seed)
    places = rng.uniform([0, 0, 0], [8, 0.5, 4], (count, 3)).tolist()
    return [
        Hold(
            k + 1,
            "hold",
            position=(x, y, z),
            colour="red" if k % 2 else "blue",
            type="jug",
            size=float(rng.uniform(0.05, 0.4)),
            area=0.01,
            colour_rgb=(200, 30, 30) if k % 2 else (30, 60, 200),
        )
        for k, (x, y, z) in enumerate(places)
    ]


def test_counts_and_areas_add_up() -> None:
    holds = some_holds(50)
    rows = count_holds(holds)
    assert sum(row.count for row in rows) == 50
    assert sum(row.area for row in rows) == pytest.approx(0.5)
    assert count_holds([]) == []


def test_an_unscaled_scan_has_the_same_size_classes() -> None:
    holds = some_holds(50)
    grown = [replace(hold, size=7 * hold.size, area=49 * hold.area) for hold in holds]
    metres, units = count_holds(holds), count_holds(grown, unit=7.0)
    assert [(row.size, row.count) for row in units] == [(row.size, row.count) for row in metres]
    assert sum(row.area for row in units) == pytest.approx(sum(row.area for row in metres))


@pytest.mark.parametrize(
    ("size", "name"), [(0.0, "XS"), (0.06, "XS"), (0.061, "S"), (0.2, "L"), (3.0, "XXL")]
)
def test_size_classes(size: float, name: str) -> None:
    assert size_class(size) == name


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.floats(-0.08, 0.08), st.floats(-0.015, 0.015))
def test_matching_survives_a_shift_and_a_turn_of_the_scan(
    seed: int, shift: float, turn: float
) -> None:
    holds = some_holds(40, seed)
    c, s = np.cos(turn), np.sin(turn)
    moved = [
        replace(
            hold,
            id=100 + hold.id,
            position=(c * x - s * y + shift, s * x + c * y, z + shift / 2),
        )
        for hold in holds
        for x, y, z in [hold.position]
    ]
    pairs = match_holds(holds, moved)
    right = sum(new == old + 100 for old, new in pairs.items())
    assert right >= 0.95 * len(holds)
    assert len(set(pairs.values())) == len(pairs)


def set_again(holds: list[Hold], seed: int) -> list[Hold]:
    """Other holds in their sockets and near them, as many as before: none is the same."""
    rng = np.random.default_rng(seed)
    away = np.where(rng.random((len(holds), 1)) < 0.15, 0.01, 0.15)
    there = np.array([hold.position for hold in holds]) + away * rng.normal(size=(len(holds), 3))
    return [
        replace(hold, id=100 + hold.id, position=tuple(place), size=float(rng.uniform(0.05, 0.4)))
        for hold, place in zip(holds, there.tolist(), strict=True)
    ]


@pytest.mark.parametrize("seed", range(4))
def test_holds_that_were_all_replaced_are_not_taken_for_the_old_ones(seed: int) -> None:
    holds = some_holds(100, seed)
    assert len(match_holds(holds, set_again(holds, seed))) <= 3


@pytest.mark.parametrize("seed", range(4))
def test_of_a_part_that_was_reset_the_rest_is_found(seed: int) -> None:
    holds = some_holds(100, seed)
    rng = np.random.default_rng(seed)
    kept = [
        replace(
            hold,
            id=100 + hold.id,
            size=hold.size * float(rng.uniform(0.97, 1.03)),
            position=tuple(np.add(hold.position, rng.normal(0.0, 0.003, 3)).tolist()),
        )
        for hold in holds[:50]
    ]
    pairs = match_holds(holds, [*kept, *set_again(holds[50:], seed)])
    right = sum(new == old + 100 and old <= 50 for old, new in pairs.items())
    assert right >= 47
    assert right >= 0.95 * len(pairs)


def test_volumes_that_stay_are_found_though_no_hold_does() -> None:
    holds = some_holds(100)
    volumes = [Hold(200 + k, "volume", position=(2.0 * k, 0.0, 1.0), size=0.5) for k in range(3)]
    pairs = match_holds([*holds, *volumes], [*set_again(holds, 5), *volumes])
    assert {old: new for old, new in pairs.items() if old >= 200} == {k: k for k in (200, 201, 202)}


def test_what_came_and_went() -> None:
    holds = some_holds(30)
    gone, *rest = holds
    swapped = replace(rest[0], size=rest[0].size * 3)
    painted = replace(rest[1], colour="green")
    new = [swapped, painted, *rest[2:], Hold(99, "hold", position=(20.0, 0.0, 1.0), size=0.1)]
    found: dict[str, list[int]] = {what: [] for what in ("came", "went", "recoloured", "stayed")}
    for change in changes(holds, new):
        hold = change.new or change.old
        assert hold is not None
        found[change.what].append(hold.id)
    assert found["went"] == [gone.id, swapped.id]
    assert found["came"] == [swapped.id, 99]
    assert found["recoloured"] == [painted.id]
    assert len(found["stayed"]) == 27


def test_csv_has_a_line_a_row_and_splits_positions() -> None:
    rows = [change.to_json() for change in changes([], some_holds(3))]
    lines = to_csv(rows).splitlines()
    assert len(lines) == 4
    assert lines[0].endswith("x,y,z")
    assert to_csv([]) == ""


def scan_of(folder: Path, holds: list[Hold]) -> Path:
    scan = ScanFolder(folder)
    Holds(metric=True, holds=tuple(holds)).save(scan.holds)
    Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True).save(
        scan.scale
    )
    return folder


def test_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    added = [Hold(90 + k, "hold", position=(9.0 + k, 0.0, 1.0), size=0.1) for k in range(2)]
    old = scan_of(tmp_path / "old", some_holds(20))
    new = scan_of(tmp_path / "new", [*some_holds(20), *added])
    out = tmp_path / "changes.json"
    assert main(["inventory", str(old), "--format", "csv"]) == 0
    assert capsys.readouterr().out.startswith("role,colour,type,size,count,area_m2")
    arguments = ["inventory", str(new), "--since", str(old), "--format", "json", "--out", str(out)]
    assert main(arguments) == 0
    assert json.loads(out.read_text())["totals"]["stayed"] == 20
    assert json.loads(out.read_text())["totals"]["came"] == 2
    assert main(["palette", "learn", str(old)]) == 0
    text = (old / "palette.toml").read_text()
    assert 'name = "red"' in text
    assert main(["palette", "learn", str(old)]) == 3  # there already
    assert main(["inventory", str(tmp_path / "none")]) == 3
    assert main(["inventory", str(old), "--changed"]) == 2
    assert main(["inventory", str(old), "--loose"]) == 2
    assert main(["inventory", str(new), "--since", str(old), "--loose"]) == 3  # no mesh
