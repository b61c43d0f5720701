"""The shipped grade model, and ranges for routes."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.core.files import shipped_file
from walltopo_climb.grades.features import FEATURES
from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.model import GradeModel, shipped_model


def rows(**changed: float) -> np.ndarray:
    values = dict.fromkeys(FEATURES, 0.5) | {"holds": 8, "steepness": 40, "climbed": 2.0} | changed
    return np.array([[values[name] for name in FEATURES]], np.float32)


@pytest.mark.parametrize("name", [name for name, sign in FEATURES.items() if sign])
def test_grades_go_the_way_that_there_is_no_doubt_about(name: str) -> None:
    model = shipped_model()
    difficulties = [
        model.difficulties(rows(**{name: value}))[0] for value in np.linspace(0, 12, 25)
    ]
    assert (np.diff(difficulties) * FEATURES[name] >= -1e-5).all()


def test_grades_take_holds_of_unknown_quality() -> None:
    unknown = rows(**{name: np.nan for name in FEATURES if name.startswith("quality")})
    assert np.isfinite(shipped_model().difficulties(unknown)).all()
    assert shipped_model().difficulties(np.zeros((0, len(FEATURES)), np.float32)).shape == (0,)


def test_grades_ranges_are_open_where_nothing_was_learnt() -> None:
    learnt = shipped_model().learnt
    for known in (False, True):
        assert learnt.bounded(learnt.easiest, known).low == 0
        assert learnt.bounded(learnt.hardest, known).high == len(FONT) - 1
        inside = learnt.bounded((learnt.easiest + learnt.hardest) / 2, known)
        assert 0 < inside.low < inside.high < len(FONT) - 1


def test_grades_another_network_is_no_grade_model() -> None:
    other = shipped_file("hold_types.onnx")
    with pytest.raises(InputError, match="grade model"):
        GradeModel.load(other)
