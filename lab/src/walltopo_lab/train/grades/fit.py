"""Fit of the grade model from problems and grades.

A scan knows type, size and lean of a gym's holds; the board data has only positions. The quality of
the board's holds is therefore estimated from the grades of training problems, and never from a
problem that it is used on. Within the training part, four-fold cross-fitting ensures this; all
other problems use the training part alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import Ridge
from sklearn.model_selection import GroupKFold

from walltopo_climb.grades.features import FEATURES
from walltopo_climb.movement.grips import NEUTRAL
from walltopo_lab.train.grades.board import CELLS, Problem
from walltopo_lab.train.grades.movement import features_of
from walltopo_lab.train.grades.split import presence

Floats = npt.NDArray[np.float64]
Features = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int64]

_FOLDS = 4
_SHRINK = 2.0  # ridge penalty: a hold of few problems is assumed average
_SPREAD = 0.2  # quality change for one standard deviation of difficulty, as between types
_WORST, _BEST = 0.15, 1.0


def regressor(seed: int = 0) -> HistGradientBoostingRegressor:
    """Return the regressor from `FEATURES` to the index in `FONT`, monotone for known signs."""
    return HistGradientBoostingRegressor(
        max_iter=300,
        learning_rate=0.05,
        max_leaf_nodes=15,
        min_samples_leaf=40,
        l2_regularization=1.0,
        monotonic_cst=list(FEATURES.values()),
        random_state=seed,
    )


@dataclass(frozen=True)
class TrainingBoard:
    """The problems of one setup of a training board, with their features.

    Parameters
    ----------
    grade : (N,) index in `FONT`. stars, groups, part : (N,); part 0 is for training.
    plain : (N, F) features of positions alone; NaN rows if the top was not reached.
    known : (N, F) features with estimated hold quality.
    quality : (CELLS,) of the holds, from all of part 0.
    seconds : (N,) CPU seconds per movement sequence.
    """

    problems: tuple[Problem, ...]
    grade: Floats
    stars: Ints
    groups: Ints
    part: Ints
    plain: Features
    known: Features
    quality: Floats
    seconds: Floats

    @property
    def reached(self) -> npt.NDArray[np.bool_]:
        """Return (N,) whether the movement model reaches the top."""
        return ~np.isnan(self.plain[:, 0])


def board_of(
    problems: tuple[Problem, ...], groups: Ints, part: Ints, workers: int
) -> TrainingBoard:
    """Return a setup with its features; runs the movement model twice on every problem."""
    grade = np.array([p.grade for p in problems], float)
    plain, seconds = features_of(problems, [None] * len(problems), workers)
    learnt = np.flatnonzero(part == 0)
    residual = _grade_residual(plain[learnt], grade[learnt], groups[learnt])
    holds = presence(problems)
    share = holds.multiply(1 / holds.sum(axis=1)).tocsr()
    whole = _hold_quality(share[learnt], residual)
    qualities: list[Floats] = [whole] * len(problems)
    for others, fold in _folds(groups[learnt]):
        crossed = _hold_quality(share[learnt[others]], residual[others])
        for k in learnt[fold]:
            qualities[k] = crossed
    known, _ = features_of(problems, list(qualities), workers)
    stars = np.array([p.stars for p in problems])
    return TrainingBoard(problems, grade, stars, groups, part, plain, known, whole, seconds)


def _folds(groups: Ints) -> list[tuple[Ints, Ints]]:
    return list(GroupKFold(_FOLDS).split(groups, groups=groups))


def _grade_residual(plain: Features, grade: Floats, groups: Ints) -> Floats:
    """Return the part of each grade that positions, fitted on other groups, do not explain."""
    plain = np.nan_to_num(plain, nan=NEUTRAL.quality)  # an all-NaN column cannot be binned
    rest = np.zeros(len(grade))
    for others, fold in _folds(groups):
        rest[fold] = grade[fold] - regressor().fit(plain[others], grade[others]).predict(
            plain[fold]
        )
    return rest


def _hold_quality(share: csr_matrix, residual: Floats) -> Floats:
    """Return (CELLS,) hold quality: lower for holds of problems harder than positions predict."""
    worse = Ridge(alpha=_SHRINK).fit(share, residual).coef_
    used = np.asarray(share.sum(axis=0)).ravel()
    mean = np.average(worse, weights=used)
    spread = np.sqrt(np.average((worse - mean) ** 2, weights=used))
    quality = NEUTRAL.quality - _SPREAD * (worse - mean) / max(spread, 1e-9)
    assert quality.shape == (CELLS,)
    return np.where(used > 0, np.clip(quality, _WORST, _BEST), NEUTRAL.quality)
