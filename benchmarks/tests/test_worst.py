"""The worst cases: counted by what they have in common, and drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.worst import A_PHOTO, SIDE, Case, sheet, table
from PIL import Image

BOX = np.array([10.0, 10, 30, 30])


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    Image.new("RGB", (80, 60), (200, 20, 20)).save(tmp_path / "a.png")
    return tmp_path / "a.png"


def test_misses_are_counted_by_what_they_have_in_common(photo: Path) -> None:
    lines = list(
        table(
            [
                Case(photo, BOX, 1, 0.2, seen=True, brightness=200),
                Case(photo, BOX, 1, 0.2, cut=True, brightness=20),
                Case(photo, BOX, 2, 0.2, carries=2, brightness=200),
                Case(photo, BOX, 2, 0.2, carries=1, brightness=200, seen=True),
            ]
        )
    )
    assert lines[2] == "| all | 2 | 1 (0.50) | 2 | 1 (0.50) |"
    assert lines[3] == "| cut by the photo's edge | 1 | 1 (1.00) | 0 | 0 (0.00) |"
    assert lines[4] == "| with another object on it | 0 | 0 (0.00) | 2 | 1 (0.50) |"
    assert lines[-1] == "| the others | 1 | 0 (0.00) | 0 | 0 (0.00) |"


def test_a_sheet_shows_few_of_one_photo_and_outlines_them(photo: Path) -> None:
    page = sheet([Case(photo, BOX, 1, rank) for rank in np.linspace(0, 1, 5)])
    drawn = (np.asarray(page) == (255, 0, 255)).all(axis=2)
    columns = np.flatnonzero(drawn.any(axis=0)) // SIDE
    assert set(columns.tolist()) == set(range(A_PHOTO))
