"""Holds that turned or moved between two scans."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.describe.matching.wedges import holds_of, save_scan, wall_with

from walltopo.cli import main
from walltopo.describe.matching.inventory import changes
from walltopo.describe.matching.motions import Motion, find_motions
from walltopo.describe.matching.patches import INSIDE, Window, patch_of

NONE = np.zeros((4, 2))


def test_a_patch_looks_straight_onto_the_hold() -> None:
    wall = wall_with([0.0, 0.0, 0.0, 0.0], NONE)
    patch = patch_of(wall, Window.around(holds_of(NONE)[0], 1.0), 1)
    assert patch[0, 0, INSIDE] == 0
    inside = patch[:, :, INSIDE] > 0
    assert 0.05 < inside.mean() < 0.3
    # The wedge is broader on its right, and red.
    rows, columns = np.nonzero(inside)
    assert np.ptp(rows[columns > 40]) > np.ptp(rows[columns < 24])
    assert np.median(patch[inside][:, 1]) > 0.1 > np.median(patch[~inside][:, 1])


@pytest.mark.parametrize("unit", [1.0, 3.0])
def test_turns_and_shifts_are_measured(unit: float) -> None:
    shifts = np.array([[0.0, 0.0], [0.0, 0.0], [0.03, -0.01], [0.0, 0.0]])
    old = wall_with([0.0, 20.0, 0.0, 0.0], NONE, unit)
    new = wall_with([0.0, 45.0, 0.0, -60.0], shifts, unit)
    before, after = holds_of(NONE, unit), holds_of(shifts, unit)
    motions = find_motions(old, new, before, after)
    assert set(motions) == {(k, k) for k in (1, 2, 3, 4)}
    assert motions[2, 2].turn == pytest.approx(25.0, abs=2.0)
    assert motions[4, 4].turn == pytest.approx(-60.0, abs=2.0)
    assert motions[3, 3].shift == pytest.approx((0.03, -0.01), abs=0.003)
    kinds = [one.what for one in changes(before, after, unit, motions)]
    assert kinds == ["stayed", "turned", "moved", "turned"]


def test_without_motions_a_turned_hold_stayed() -> None:
    holds = holds_of(NONE)
    assert [one.what for one in changes(holds, holds)] == ["stayed"] * 4


def test_a_motion_that_explains_little_counts_for_nothing() -> None:
    assert not Motion(30.0, (0.0, 0.0), error=2.0, still_error=2.1).is_turned
    assert not Motion(30.0, (0.0, 0.0), error=50.0, still_error=90.0).is_turned
    assert not Motion(2.0, (0.002, 0.0), error=0.5, still_error=2.0).is_moved


def test_the_command_lists_what_turned_and_moved(tmp_path: Path) -> None:
    shifts = np.array([[0.0, 0.0], [0.0, 0.0], [0.03, -0.01], [0.0, 0.0]])
    old = save_scan(tmp_path / "old", [0.0, 20.0, 0.0, 0.0], NONE)
    new = save_scan(tmp_path / "new", [0.0, 45.0, 0.0, 0.0], shifts)
    out = tmp_path / "changes.json"
    words = ["inventory", str(new.root), "--since", str(old.root), "--loose", "--format", "json"]
    assert main([*words, "--out", str(out)]) == 0
    rows = json.loads(out.read_text())["rows"]
    assert [row["what"] for row in rows] == ["stayed", "turned", "moved", "stayed"]
    assert rows[1]["turn_deg"] == pytest.approx(25.0, abs=2.0)
    assert rows[2]["moved_m"] == pytest.approx(0.032, abs=0.003)
