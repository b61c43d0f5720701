"""The patterns of colours that look alike: the file is current, and what it says holds."""

from __future__ import annotations

import numpy as np
import pytest
from viewer import colour_vision

from walltopo.describe.classify.palette import REFERENCE


def test_the_file_is_what_the_script_writes() -> None:
    assert colour_vision.FILE.read_text() == colour_vision.text(), (
        "python viewer/colour_vision.py writes another file"
    )


@pytest.mark.parametrize("vision", colour_vision.alike())
def test_colours_that_look_alike_have_different_patterns(vision: str) -> None:
    others = colour_vision.alike()[vision]
    patterns = colour_vision.patterns(others)
    assert others
    for paint, similar in others.items():
        assert all(patterns[paint] != patterns[other] for other in similar)
    assert set(patterns.values()) <= set(range(5)), "the viewer draws five"


def test_the_known_confusions_are_found() -> None:
    found = colour_vision.alike()
    assert "brown" in found["protan"]["red"]
    assert "red" in found["deutan"]["green"]
    assert "purple" in found["deutan"]["blue"]
    assert "sky" in found["tritan"]["mint"]
    assert "blue" not in found["deutan"].get("yellow", [])


def test_usual_vision_confuses_nothing() -> None:
    distances = colour_vision.distances()
    same = colour_vision.distances(np.eye(3))
    assert distances == pytest.approx(same)
    assert min(distances.values()) > 0.05
    assert {colour_vision.ink(paint) for paint in ("white", "yellow")} == {"#000"}
    assert {colour_vision.ink(paint) for paint in ("black", "blue")} == {"#fff"}
    assert set(REFERENCE) >= {paint for pair in distances for paint in pair}
