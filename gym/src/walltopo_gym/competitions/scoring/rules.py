"""The rules of a round, and their numbers."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from typing import Any, Final
from uuid import UUID

from walltopo_gym.competitions.scoring.formulas import (
    score_2018,
    score_2025,
    score_most_tops,
    score_points,
    score_shared,
)
from walltopo_gym.competitions.scoring.lead import score_lead, score_lead_points
from walltopo_gym.competitions.scoring.score import AttemptedProblem, Score


class Rules(StrEnum):
    """Names of the rules."""

    POINTS = "points"
    SHARED = "shared"
    IFSC_2025 = "ifsc-2025"
    IFSC_2018 = "ifsc-2018"
    MAX = "most"
    IFSC_LEAD = "ifsc-lead"
    LEAD_POINTS = "lead-points"


LEAD_RULES: Final = frozenset({Rules.IFSC_LEAD, Rules.LEAD_POINTS})

_WORTH: Final = {
    Rules.POINTS: {"flash": 120, "top": 100, "zone": 40},
    Rules.SHARED: {"flash": 0, "top": 1000, "zone": 0},
}


@dataclass(frozen=True, slots=True)
class Field:
    """Numbers of the other competitors of a category, on which a score depends.

    Parameters
    ----------
    tops, zones : number of competitors who have each problem.
    ranks : the competitor's rank on each route of a lead round.
    routes : number of routes of the category in a lead round.
    """

    tops: Mapping[UUID, int] = field(default_factory=dict)
    zones: Mapping[UUID, int] = field(default_factory=dict)
    ranks: Mapping[UUID, Fraction] = field(default_factory=dict)
    routes: int = 0


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
        return self.rules not in (Rules.IFSC_2018, Rules.IFSC_LEAD)

    @property
    def is_lead(self) -> bool:
        """Return whether results are high points on routes."""
        return self.rules in LEAD_RULES

    def score(self, tried: Collection[AttemptedProblem], rivals: Field) -> Score:
        """Return a score from marks."""
        worth = dict(self.worth)
        match self.rules:
            case Rules.POINTS:
                return score_points(tried, worth, self.best)
            case Rules.SHARED:
                return score_shared(tried, worth, self.best, rivals.tops, rivals.zones)
            case Rules.IFSC_2025:
                return score_2025(tried)
            case Rules.IFSC_2018:
                return score_2018(tried)
            case Rules.MAX:
                return score_most_tops(tried)
            case Rules.IFSC_LEAD:
                return score_lead(tried, rivals.ranks, rivals.routes)
            case Rules.LEAD_POINTS:
                return score_lead_points(tried, self.best)
