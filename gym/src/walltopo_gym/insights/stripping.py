"""Suggestions of routes to strip, by counted reasons without weights.

Each of these reasons counts one:

- `planned`: its planned day is here, or within a week;
- `old`: it is on the wall for `OLD` days (eight weeks);
- `quiet`: it is on the wall for four weeks, and its ascents of these are fewer than half of the
  median of all such routes;
- `disliked`: its shrunk stars are in the lowest quarter of the routes with votes, and below their
  median; at least three people have voted;
- `renew`: more votes for renewing than for keeping it;
- `worn`: its holds are due for washing.

`keep`, more votes for keeping than for renewing it, subtracts one. Routes with a positive count are
listed, the highest first, older ones first among equals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from statistics import median, quantiles
from typing import Final
from uuid import UUID

from walltopo_gym.insights.routes import RECENT, OfRoute

OLD: Final = 56
_SOON: Final = timedelta(days=7)
_VOTES: Final = 3


@dataclass(frozen=True)
class Suggestion:
    """A route to strip, with the reasons for and `against` it."""

    route_id: UUID
    reasons: tuple[str, ...]
    against: tuple[str, ...]


def what_to_strip(routes: Sequence[OfRoute], today: date, wash_after: int) -> list[Suggestion]:
    """Return the routes to strip, the most urgent first.

    Parameters
    ----------
    routes : the current ones; wash_after : tries after which holds are due for washing.
    """
    hung = [route.use.recent for route in routes if route.age >= RECENT.days]
    usual = median(hung) if hung else 0.0
    stars = [r.stars for r in routes if r.stars is not None and r.votes > 0]
    lowest = quantiles(stars, n=4, method="inclusive")[0] if len(stars) > 1 else 0.0
    middle = median(stars) if stars else 0.0
    found = []
    for route in routes:
        stands = {
            "planned": route.strip_on is not None and route.strip_on <= today + _SOON,
            "old": route.age >= OLD,
            "quiet": route.age >= RECENT.days and 2 * route.use.recent < usual,
            "disliked": route.stars is not None
            and route.votes >= _VOTES
            and route.stars <= lowest
            and route.stars < middle,
            "renew": route.renew > route.keep,
            "worn": route.use.worn >= wash_after,
        }
        reasons = tuple(name for name, is_so in stands.items() if is_so)
        against = ("keep",) if route.keep > route.renew else ()
        if len(reasons) > len(against):
            found.append(
                (len(reasons) - len(against), route, Suggestion(route.id, reasons, against))
            )
    found.sort(key=lambda one: (-one[0], -one[1].age, str(one[1].id)))
    return [suggestion for _, _, suggestion in found]
