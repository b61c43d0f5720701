"""Fit the shipped grade model and measure its errors."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt
import onnx
from sklearn.ensemble import HistGradientBoostingRegressor

from walltopo.core.files import atomic_path
from walltopo_climb.grades.features import FEATURES
from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.model import Errors
from walltopo_lab.train.grades.fit import Features, Floats, TrainingBoard, regressor
from walltopo_lab.train.grades.trees import as_onnx

COVERAGE = 0.8
_CREDIT = (
    "Learnt from problems of the MoonBoard, set-ups 2016 and 2017, as collected in "
    "github.com/andrew-houghton/moon-board-climbing (MIT); the problems are their setters'."
)


def fit_on(boards: Sequence[TrainingBoard]) -> HistGradientBoostingRegressor:
    """Return the regression on part 0 of the boards, with each problem twice.

    One copy has its holds' quality, the other only positions, as on a wall without hold types.
    """
    rows = [(board, (board.part == 0) & board.reached) for board in boards]
    table = [board.plain[mine] for board, mine in rows] + [
        board.known[mine] for board, mine in rows
    ]
    grade = np.concatenate([board.grade[mine] for board, mine in rows])
    return regressor().fit(np.concatenate(table), np.concatenate([grade, grade]))


def errors_of(difficulty: Floats, grade: Floats) -> Errors:
    """Return the errors on problems outside the training part (split conformal)."""
    off = np.sort(np.abs(difficulty - grade))
    rank = int(np.ceil(COVERAGE * (len(off) + 1)))
    return Errors(float(np.std(difficulty - grade)), float(off[min(rank, len(off)) - 1]), COVERAGE)


def write_model(
    model: HistGradientBoostingRegressor, boards: Sequence[TrainingBoard], path: Path
) -> None:
    """Write the model with its errors on part 1 of the boards."""

    def errors(which: str) -> Errors:
        rows: list[tuple[Features, npt.NDArray[np.bool_], TrainingBoard]] = [
            (getattr(board, which), (board.part == 1) & board.reached, board) for board in boards
        ]
        difficulty = np.concatenate([model.predict(table[mine]) for table, mine, _ in rows])
        return errors_of(difficulty, np.concatenate([board.grade[mine] for _, mine, board in rows]))

    grades = np.concatenate([board.grade for board in boards])
    about = {
        "features": list(FEATURES),
        "known": msgspec.to_builtins(errors("known")),
        "plain": msgspec.to_builtins(errors("plain")),
        "easiest": FONT[int(np.quantile(grades, 0.005))],
        "hardest": FONT[int(np.quantile(grades, 0.995))],
    }
    network = as_onnx(model, len(FEATURES))
    onnx.helper.set_model_props(network, {"grades": json.dumps(about), "credit": _CREDIT})
    with atomic_path(path) as temporary:
        temporary.write_bytes(network.SerializeToString())
