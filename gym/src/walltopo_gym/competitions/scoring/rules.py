"""Which rules a round has, and their numbers."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final
from uuid import UUID

from walltopo_gym.competitions.scoring.ifsc import score_2018, score_2025
from walltopo_gym.competitions.scoring.most import score_most
from walltopo_gym.competitions.scoring.points import score_points
from walltopo_gym.competitions.scoring.score import Score, Tried
from walltopo_gym.competitions.scoring.shared import score_shared


class Rules(StrEnum):
    """By their names."""

    POINTS = "points"
    SHARED = "shared"
    IFSC_2025 = "ifsc-2025"
    IFSC_2018 = "ifsc-2018"
    MOST = "most"


_WORTH: Final = {
    Rules.POINTS: {"flash": 120, "top": 100, "zone": 40},
    Rules.SHARED: {"flash": 0, "top": 1000, "zone": 0},
}


@dataclass(frozen=True)
class Scoring:
    """The rules of a round.

    Parameters
    ----------
    worth : {flash, top, zone} of a problem; best : how many problems count, None: all.
    """

    rules: Rules
    worth: Mapping[str, int]
    best: int | None

    @classmethod
    def of(cls, kept: Mapping[str, Any]) -> Scoring:
        """As a round's row keeps it; what is not said is as usual."""
        rules = Rules(kept["rules"])
        usual = _WORTH.get(rules, {})
        said = {name: kept[name] for name in usual if kept.get(name) is not None}
        return cls(rules, {**usual, **said}, kept.get("best"))

    @property
    def has_points(self) -> bool:
        """Whether scores can be added up over rounds."""
        return self.rules != Rules.IFSC_2018

    def score(
        self, tried: Collection[Tried], tops: Mapping[UUID, int], zones: Mapping[UUID, int]
    ) -> Score:
        """What somebody has; `tops`, `zones`: how many of the category have each problem."""
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
            case Rules.MOST:
                return score_most(tried)
