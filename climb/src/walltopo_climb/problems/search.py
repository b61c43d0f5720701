"""The search for problems: simulated annealing (Kirkpatrick, Gelatt and Vecchi 1983) from many
beginnings; of all that was judged the best that differ from each other are proposed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from walltopo.core import InputError
from walltopo.scans.moves import GradeRow
from walltopo_climb.grades.font import FONT
from walltopo_climb.grades.model import Range
from walltopo_climb.grades.of_scan import Scale
from walltopo_climb.movement.body import BODIES, Body
from walltopo_climb.movement.rows import climber_rows
from walltopo_climb.problems.draft import Chance, Draft
from walltopo_climb.problems.judge import Judge, Judged
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.rows import Proposal, Proposals
from walltopo_climb.problems.wish import Wish

_BEGINNINGS, _MORE = 8, 2  # chains, and more of them for each proposal
_STEPS = 80  # of each
_HOT, _COLD = 1.0, 0.1  # grades: a step that is so much worse is often, is seldom taken
_ALIKE = 0.5  # share of common holds: no two proposals are more alike


def propose(
    pool: Pool, wish: Wish, scale: Scale, stirred: Callable[[int, int], None] | None = None
) -> Proposals:
    """Problems on the holds of a wall, as near to a wish as the search comes.

    The same wall, wish and scale give the same proposals.

    Parameters
    ----------
    stirred : called with how many of how many beginnings are done.

    Raises
    ------
    InputError : the wish is none (`Wish`), or the wall has no hold to begin on.
    """
    body = wish.body
    if int(pool.hands.sum()) < 3 or not pool.starts(body).any():
        raise InputError(
            "this wall has no holds that a problem could be set on",
            "It wants at least three for hands, one of them between knee and head.",
        )
    judge = Judge(pool, wish, scale)
    count = _BEGINNINGS + _MORE * wish.count
    for k, random in enumerate(np.random.default_rng(wish.seed).spawn(count)):
        _anneal(Chance(pool, wish, body, random), judge, random)
        if stirred is not None:
            stirred(k + 1, count)
    chosen = _different(judge.seen, wish.count)
    rows = [_row(pool, wish, scale, one, chosen) for one in chosen]
    return Proposals(unit=pool.unit, tried=len(judge), proposals=tuple(rows))


def _anneal(chance: Chance, judge: Judge, random: np.random.Generator) -> None:
    """One chain; what it finds is in `judge.seen`."""
    first = next((draft for _ in range(5) if (draft := chance.first()) is not None), None)
    if first is None:
        return
    now = judge.of(first)
    for step in range(_STEPS):
        heat = _HOT * (_COLD / _HOT) ** (step / _STEPS)
        other = judge.of(_tidy(now) or chance.varied(now.draft))
        worse = other.off - now.off
        if worse <= 0 or random.random() < math.exp(-worse / heat):
            now = other
    while (tidy := _tidy(now)) is not None:
        now = judge.of(tidy)


def _tidy(judged: Judged) -> Draft | None:
    """Without the holds that nobody uses; None where all are used."""
    draft = judged.draft
    if not judged.reached or draft.holds <= judged.used:
        return None
    return replace(
        draft,
        hands=tuple(number for number in draft.hands if number in judged.used),
        feet=tuple(number for number in draft.feet if number in judged.used),
    )


def _different(seen: Sequence[Judged], count: int) -> list[Judged]:
    """The best, each with holds of its own."""
    able = [one for one in seen if one.reached and one.draft.holds <= one.used]
    chosen: list[Judged] = []
    for one in sorted(able, key=lambda one: one.off):
        if len(chosen) == count:
            break
        if all(alike(one.draft, other.draft) <= _ALIKE for other in chosen):
            chosen.append(one)
    return chosen


def alike(one: Draft, other: Draft) -> float:
    """The share of common holds (Jaccard)."""
    return len(one.holds & other.holds) / len(one.holds | other.holds)


def _row(
    pool: Pool, wish: Wish, scale: Scale, judged: Judged, chosen: Sequence[Judged]
) -> Proposal:
    draft = judged.draft
    bodies: dict[str, Body] = dict(BODIES)
    if wish.body not in bodies.values():
        bodies["you"] = wish.body
    others = [alike(draft, other.draft) for other in chosen if other is not judged]
    upwards = sorted(
        draft.hands[draft.starts : -1], key=lambda number: pool.by_id[number].position[2]
    )
    return Proposal(
        hands=(*draft.route.start, *upwards, *draft.route.top),
        start=draft.route.start,
        top=draft.route.top,
        feet=draft.feet,
        grade=grade_row(scale.range(judged.place, judged.known)),
        moves=judged.moves,
        misses=judged.misses,
        alike=round(max(others, default=0.0), 3),
        climbers=climber_rows(draft.route, pool.near(tuple(draft.holds)), pool.unit, bodies),
    )


def grade_row(found: Range) -> GradeRow:
    """A range with its grades by name."""
    return GradeRow(FONT[found.low], FONT[found.high], found.coverage, found.graded)
