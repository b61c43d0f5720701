"""Interface of a tuning task: named settings with ranges, and a metric on labelled walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True)
class Range:
    """The range of one tuned setting.

    Parameters
    ----------
    name : key in the settings section.
    low, high : bounds, inclusive.
    default : the current default; the first trial, so that the result is never worse.
    curve : the search runs evenly over ((value - low) / (high - low)) ** (1 / curve); above 1 it
        looks closer at small values, and reaches `low` itself, as a logarithm would not.
    """

    name: str
    low: float
    high: float
    default: float
    curve: float = 1.0

    def value(self, share: float) -> float:
        """Return the setting's value at a position in [0, 1] of the search."""
        return self.low + (self.high - self.low) * float(share**self.curve)

    def share(self, value: float) -> float:
        """Return the position in [0, 1] of a value."""
        return float(((value - self.low) / (self.high - self.low)) ** (1 / self.curve))


class Task(Protocol):
    """A set of settings to tune, with the metric that they maximise."""

    @property
    def section(self) -> str:
        """Return the section of walltopo.toml."""

    @property
    def figure(self) -> str:
        """Return the name of the maximised metric."""

    @property
    def ranges(self) -> Sequence[Range]:
        """Return the ranges of the tuned settings."""

    @property
    def fixed(self) -> Mapping[str, Any]:
        """Return the settings of the section that are fixed and belong to the result."""

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the metric on each wall, by the wall's name.

        Raises
        ------
        SettingsError : the values are incompatible; the search scores them as the worst.
        """
