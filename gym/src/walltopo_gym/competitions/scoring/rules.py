"""The rules of a round, and their numbers."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final
from uuid import UUID

from walltopo_gym.competitions.scoring.formulas import (
    score_2018,
    score_2025,
    score_most,
    score_points,
    score_shared,
)
from walltopo_gym.competitions.scoring.score import AttemptedProblem, Score


class Rules(StrEnum):
    """Names of the rules."""

    POINTS = "points"
    SHARED = "shared"
    IFSC_2025 = "ifsc-2025"
    IFSC_2018 = "ifsc-2018"
    MAX = "most"


_WORTH: Final = {
    Rules.POINTS: {"flash": 120, "top": 100, "zone": 40},
    Rules.SHARED: {"flash": 0, "top": 1000, "zone": 0},
}


@dataclass(frozen=True)
class Scoring:
    """The rules of a round.

    Parameters
    ----------
    worth : {flash, top, zone} of a problem; best : number of problems that count, None: all.
    """

    rules: Rules
    worth: Mapping[str, int]
    best: int | None

    @classmethod
    def of(cls, kept: Mapping[str, Any]) -> Scoring:
        """Return the rules of a round's row; missing numbers take their defaults."""
        rules = Rules(kept["rules"])
        usual = _WORTH.get(rules, {})
        chosen = {name: kept[name] for name in usual if kept.get(name) is not None}
        return cls(rules, {**usual, **chosen}, kept.get("best"))

    @property
    def has_points(self) -> bool:
        """Return whether scores can be added up over rounds."""
        return self.rules != Rules.IFSC_2018

    def score(
        self,
        tried: Collection[AttemptedProblem],
        tops: Mapping[UUID, int],
        zones: Mapping[UUID, int],
    ) -> Score:
        """Return a score from marks; `tops`, `zones`: number of the category who have each
        problem."""
        worth = dict(self.worth)
        match self.rules:
            case Rules.POINTS:
                return score_points(tried, worth, self.best)
            case Rules.SHARED:
                return score_shared(tried, worth, self.best, tops, zones)
            case Rules.IFSC_2025:
                return score_2025(tried)
            case Rules.IFSC_2018:
                return score_2018(tried)
            case Rules.MAX:
                return score_most(tried)
