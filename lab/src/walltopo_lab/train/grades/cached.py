"""Cache of boards with movement features, which take minutes to compute."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from walltopo.core.files import atomic_path
from walltopo_lab.train.grades.board import SETUPS, read_problems
from walltopo_lab.train.grades.fit import TrainingBoard, board_of
from walltopo_lab.train.grades.split import groups_of, parts_of

SHARES = (0.60, 0.15, 0.25)  # shares of the problems for training, for error ranges, for evaluation
_SEED = 21
_ARRAYS = ("grade", "stars", "groups", "part", "plain", "known", "quality", "seconds")


def training_boards(
    data: Path, cache: Path, workers: int, setups: Sequence[str] = SETUPS
) -> dict[str, TrainingBoard]:
    """Return the setups of `board-grades` by name; read from `cache`, or computed and stored."""
    found = {}
    for setup in setups:
        problems = read_problems(data / "board-grades" / f"moonboard-{setup}.json")
        path = cache / f"{setup}.npz"
        if path.is_file():
            with np.load(path) as arrays:
                found[setup] = TrainingBoard(problems, *(arrays[name] for name in _ARRAYS))
            continue
        groups = groups_of(problems)
        board = board_of(problems, groups, parts_of(groups, SHARES, _SEED), workers)
        cache.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary, temporary.open("wb") as file:
            np.savez(file, **{name: getattr(board, name) for name in _ARRAYS})
        found[setup] = board
    return found
