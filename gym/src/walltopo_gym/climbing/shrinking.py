"""Shrunk means: items with few values are drawn towards the mean of all.

Empirical Bayes for a one-way layout (Efron and Morris 1975; the variances by moments, as in an
analysis of variance): item i has n_i values of mean x_i. s2 is the variance within items, t2 that
between their true means; m is the mean of the items, weighted by 1 / (t2 + s2 / n_i). Then

    shrunk_i = m + B_i (x_i - m),    B_i = t2 / (t2 + s2 / n_i)

An item with many values keeps its mean, one with few moves to m, and all do if the items differ by
chance only.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Final, TypeVar

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class Sample:
    """Values of one item: how many, their sum, and the sum of their squares."""

    n: int
    total: float
    squares: float

    def __add__(self, other: Sample) -> Sample:
        return Sample(self.n + other.n, self.total + other.total, self.squares + other.squares)

    @classmethod
    def of_shares(cls, yes: int, of: int) -> Sample:
        """Return a sample of `of` values, `yes` of which are 1 and the others 0."""
        return cls(of, yes, yes)

    @property
    def mean(self) -> float:
        return self.total / self.n


NOTHING: Final = Sample(0, 0.0, 0.0)


def shrunk_means(samples: Mapping[Key, Sample]) -> dict[Key, float]:
    """Return the shrunk mean of each item that has values.

    A single item keeps its mean. If no item has two values, their variance is unknown, and all get
    the common mean.
    """
    items = {key: sample for key, sample in samples.items() if sample.n > 0}
    if len(items) < 2:
        return {key: sample.mean for key, sample in items.items()}
    within, between = _estimate_variances(list(items.values()))
    if between == 0.0:
        whole = sum(items.values(), NOTHING).mean
        return dict.fromkeys(items, whole)
    weights = {key: 1 / (between + within / sample.n) for key, sample in items.items()}
    middle = sum(weights[key] * items[key].mean for key in items) / sum(weights.values())
    return {
        key: middle + between * weights[key] * (sample.mean - middle)
        for key, sample in items.items()
    }


def _estimate_variances(items: list[Sample]) -> tuple[float, float]:
    """Return the variance within items and between their true means; the latter is 0 if it cannot
    be estimated."""
    whole = sum(items, NOTHING)
    freedom = whole.n - len(items)
    if freedom == 0:
        return 0.0, 0.0
    inside = sum(max(0.0, one.squares - one.total**2 / one.n) for one in items) / freedom
    apart = sum(one.n * (one.mean - whole.mean) ** 2 for one in items) / (len(items) - 1)
    size = (whole.n - sum(one.n**2 for one in items) / whole.n) / (len(items) - 1)
    return inside, max(0.0, (apart - inside) / size)
