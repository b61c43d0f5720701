"""Movement features of many problems, computed on all processors."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import numpy.typing as npt

from walltopo_climb.grades.features import FEATURES, features
from walltopo_climb.movement.body import ADULT
from walltopo_climb.movement.sequence import find_sequence
from walltopo_lab.train.grades.board import Problem, as_climb

Qualities = npt.NDArray[np.float64]
Row = tuple[npt.NDArray[np.float32] | None, float]


def move(problem: Problem, quality: Qualities | None) -> Row:
    """Return a problem's features (None: the top was not reached) and their CPU seconds."""
    began = time.process_time()
    climb = as_climb(problem, quality)
    sequence = find_sequence(climb, ADULT)
    if sequence is None or not sequence.reached:
        return None, time.process_time() - began
    return features(climb, sequence, quality is not None), time.process_time() - began


def features_of(
    problems: tuple[Problem, ...], quality: list[Qualities | None], workers: int
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64]]:
    """Return (N, F) features, with NaN rows if the top was not reached, and (N,) CPU seconds.

    Parameters
    ----------
    quality : for each problem, see `as_climb`. workers : number of processes.
    """
    if problems:
        move(problems[0], quality[0])  # compile before forking, once for all processes
    with ProcessPoolExecutor(workers, mp_context=get_context("fork")) as pool:
        rows = list(pool.map(move, problems, quality, chunksize=64))
    blank = np.full(len(FEATURES), np.nan, np.float32)
    table = np.stack([blank if row is None else row for row, _ in rows])
    return table, np.array([seconds for _, seconds in rows])
