"""What is tuned: named numbers with ranges, and a figure on labelled walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True)
class Range:
    """One tuned setting.

    Parameters
    ----------
    name : key in the settings section.
    low, high : inclusive.
    default : the present default; the first trial, so that the result is never worse.
    curve : the search runs evenly over ((value - low) / (high - low)) ** (1 / curve); above 1 it
        looks closer at small values, and reaches `low` itself, as a logarithm would not.
    """

    name: str
    low: float
    high: float
    default: float
    curve: float = 1.0

    def value(self, share: float) -> float:
        """The setting at a place in [0, 1] of the search."""
        return self.low + (self.high - self.low) * float(share**self.curve)

    def share(self, value: float) -> float:
        """The place in [0, 1] of a value."""
        return float(((value - self.low) / (self.high - self.low)) ** (1 / self.curve))


class Problem(Protocol):
    """Something to tune."""

    @property
    def section(self) -> str:
        """Section of walltopo.toml."""

    @property
    def figure(self) -> str:
        """Name of what is maximised."""

    @property
    def ranges(self) -> Sequence[Range]:
        """The tuned settings."""

    @property
    def fixed(self) -> Mapping[str, Any]:
        """Other settings of the section that belong to the result."""

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        """The figure on each wall, by the wall's name.

        Raises
        ------
        SettingsError : the values do not go together; the search counts that as the worst.
        """
