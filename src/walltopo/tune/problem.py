"""What is tuned: named numbers with ranges, and a figure on labelled walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

__all__ = ["Problem", "Range"]


@dataclass(frozen=True)
class Range:
    """One tuned setting.

    Parameters
    ----------
    name : key in the settings section.
    low, high : inclusive.
    default : the present default; the first trial, so that the result is never worse.
    log : search by ratio instead of by difference.
    """

    name: str
    low: float
    high: float
    default: float
    log: bool = False


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
