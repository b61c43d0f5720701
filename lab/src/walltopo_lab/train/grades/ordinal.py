"""Ordered logit from a grade index to probabilities (McCullagh 1980, proportional odds)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.special import expit

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class OrderedLogit:
    """Probabilities of `grades` (K,): P(grade <= k) = logistic(cuts[k] - slope * difficulty)."""

    grades: Ints
    cuts: Floats
    slope: float

    def probabilities(self, difficulty: Floats) -> Floats:
        """Return the (N, K) probabilities."""
        below = expit(self.cuts[None, :] - self.slope * difficulty[:, None])
        edges = np.concatenate(
            [np.zeros((len(difficulty), 1)), below, np.ones((len(difficulty), 1))], axis=1
        )
        return np.asarray(np.diff(edges, axis=1))

    def most_likely(self, difficulty: Floats) -> Ints:
        """Return (N,) the most likely grade."""
        return self.grades[self.probabilities(difficulty).argmax(axis=1)]

    def middle(self, difficulty: Floats) -> Ints:
        """Return (N,) the median grade, which minimises the expected absolute error."""
        return self.grades[(self.probabilities(difficulty).cumsum(axis=1) >= 0.5).argmax(axis=1)]

    def within_one(self, difficulty: Floats) -> Ints:
        """Return (N,) the grade that is most likely correct within one step."""
        odds = np.zeros((len(difficulty), int(self.grades[-1] - self.grades[0]) + 1))
        odds[:, self.grades - self.grades[0]] = self.probabilities(difficulty)
        padded = np.pad(odds, ((0, 0), (1, 1)))
        window = padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]
        return np.asarray(window.argmax(axis=1) + self.grades[0])


def fit_ordered(difficulty: Floats, grade: Ints) -> OrderedLogit:
    """Fit the grades that occur, and the cuts between them, by maximum likelihood."""
    grades, index = np.unique(grade, return_inverse=True)
    shares = np.cumsum(np.bincount(index))[:-1] / len(index)
    slope = 1.7 / max(float(np.std(grade - difficulty)), 0.3)
    first = np.log(shares / (1 - shares)) * 1.5 + slope * float(difficulty.mean())
    begin = np.concatenate([[first[0]], np.log(np.maximum(np.diff(first), 1e-3)), [slope]])

    def unpack(values: Floats) -> tuple[Floats, float]:
        return np.cumsum(np.concatenate([values[:1], np.exp(values[1:-1])])), float(values[-1])

    def loss(values: Floats) -> float:
        cuts, steep = unpack(values)
        edges = np.concatenate([[-np.inf], cuts, [np.inf]])
        odds = expit(edges[index + 1] - steep * difficulty) - expit(
            edges[index] - steep * difficulty
        )
        return float(-np.log(np.maximum(odds, 1e-12)).mean())

    best = minimize(loss, begin, method="L-BFGS-B")
    cuts, steep = unpack(best.x)
    return OrderedLogit(grades, cuts, steep)
