"""What to strip next: reasons in words, counted; no weights.

Reasons for it, each of which counts one:

- `planned`: the day that the setter has said for it is here, or within a week;
- `old`: it has hung for `OLD` days (eight weeks);
- `quiet`: it has hung for four weeks, and its ascents of these are fewer than half of the median
  of all routes that have;
- `disliked`: its shrunk stars are in the lowest quarter of the routes that have votes, and lower
  than the median of these; at least three have voted;
- `renew`: more wishes to renew it than to keep it;
- `worn`: its holds are due for washing (`wear.py`).

`keep`, more wishes to keep it than to renew it, takes one off. What has a reason and more for it
than against is listed, the most first; of equal ones the older first.
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
    """A route to strip: reasons for it, and `against` it."""

    route_id: UUID
    reasons: tuple[str, ...]
    against: tuple[str, ...]


def what_to_strip(
    routes: Sequence[OfRoute], today: date, wash_after: int
) -> list[Suggestion]:  # fmt: skip
    """Routes to strip, the first one first.

    Parameters
    ----------
    routes : that hang; wash_after : tries after which holds are due for washing.
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
            "disliked": route.stars is not None and route.votes >= _VOTES
            and route.stars <= lowest and route.stars < middle,
            "renew": route.renew > route.keep,
            "worn": route.use.worn >= wash_after,
        }  # fmt: skip
        reasons = tuple(name for name, is_so in stands.items() if is_so)
        against = ("keep",) if route.keep > route.renew else ()
        if len(reasons) > len(against):
            found.append(
                (len(reasons) - len(against), route, Suggestion(route.id, reasons, against))
            )
    found.sort(key=lambda one: (-one[0], -one[1].age, str(one[1].id)))
    return [suggestion for _, _, suggestion in found]
