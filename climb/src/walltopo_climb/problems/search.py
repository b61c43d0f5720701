"""Search for problems by simulated annealing (Kirkpatrick, Gelatt and Vecchi 1983).

Several chains run from random starts. The best scored candidates that share few holds are proposed.
"""

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
from walltopo_climb.problems.candidate import Candidate, Sampler
from walltopo_climb.problems.judge import Judge, Judged
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.rows import Proposal, Proposals
from walltopo_climb.problems.spec import ProblemSpec

_CHAINS, _MORE = 8, 2  # number of chains, and of additional ones per proposal
_STEPS = 80  # per chain
_HOT, _COLD = 1.0, 0.1  # first and last temperature, in grades
_MAX_ALIKE = 0.5  # maximum share of common holds of two proposals


def propose(
    pool: Pool, spec: ProblemSpec, scale: Scale, advance: Callable[[int, int], None] | None = None
) -> Proposals:
    """Return problems on the holds of a wall, as near to a specification as the search gets.

    The result is deterministic for a wall, specification and scale.

    Parameters
    ----------
    advance : called with the number of finished chains and the total.

    Raises
    ------
    InputError : the specification is invalid (`ProblemSpec`), or the wall has no start hold.
    """
    body = spec.body
    if int(pool.hands.sum()) < 3 or not pool.starts(body).any():
        raise InputError(
            "this wall does not have the holds for a problem",
            "A problem needs at least three hand holds, one of them between knee and head.",
        )
    judge = Judge(pool, spec, scale)
    count = _CHAINS + _MORE * spec.count
    for k, random in enumerate(np.random.default_rng(spec.seed).spawn(count)):
        _run_chain(Sampler(pool, spec, body, random), judge, random)
        if advance is not None:
            advance(k + 1, count)
    chosen = _diverse_candidates(judge.seen, spec.count)
    rows = [_make_proposal(pool, spec, scale, one, chosen) for one in chosen]
    return Proposals(unit=pool.unit, tried=len(judge), proposals=tuple(rows))


def _run_chain(sampler: Sampler, judge: Judge, random: np.random.Generator) -> None:
    """Run one chain; `judge.seen` collects its candidates."""
    first = next((found for _ in range(5) if (found := sampler.first()) is not None), None)
    if first is None:
        return
    now = judge.of(first)
    for step in range(_STEPS):
        heat = _HOT * (_COLD / _HOT) ** (step / _STEPS)
        other = judge.of(_drop_unused_holds(now) or sampler.change_one(now.candidate))
        worse = other.off - now.off
        if worse <= 0 or random.random() < math.exp(-worse / heat):
            now = other
    while (tidy := _drop_unused_holds(now)) is not None:
        now = judge.of(tidy)


def _drop_unused_holds(judged: Judged) -> Candidate | None:
    """Return the candidate without its unused holds, or None if all are used."""
    candidate = judged.candidate
    if not judged.reached or candidate.holds <= judged.used:
        return None
    return replace(
        candidate,
        hands=tuple(number for number in candidate.hands if number in judged.used),
        feet=tuple(number for number in candidate.feet if number in judged.used),
    )


def _diverse_candidates(seen: Sequence[Judged], count: int) -> list[Judged]:
    """Return the best candidates that share few holds."""
    able = [one for one in seen if one.reached and one.candidate.holds <= one.used]
    chosen: list[Judged] = []
    for one in sorted(able, key=lambda one: one.off):
        if len(chosen) == count:
            break
        if all(hold_overlap(one.candidate, other.candidate) <= _MAX_ALIKE for other in chosen):
            chosen.append(one)
    return chosen


def hold_overlap(one: Candidate, other: Candidate) -> float:
    """Return the share of common holds (Jaccard index)."""
    return len(one.holds & other.holds) / len(one.holds | other.holds)


def _make_proposal(
    pool: Pool, spec: ProblemSpec, scale: Scale, judged: Judged, chosen: Sequence[Judged]
) -> Proposal:
    candidate = judged.candidate
    bodies: dict[str, Body] = dict(BODIES)
    if spec.body not in bodies.values():
        bodies["you"] = spec.body
    others = [hold_overlap(candidate, other.candidate) for other in chosen if other is not judged]
    upwards = sorted(
        candidate.hands[candidate.starts : -1], key=lambda number: pool.by_id[number].position[2]
    )
    return Proposal(
        hands=(*candidate.route.start, *upwards, *candidate.route.top),
        start=candidate.route.start,
        top=candidate.route.top,
        feet=candidate.feet,
        grade=grade_row(scale.range(judged.difficulty, judged.known)),
        moves=judged.moves,
        violations=judged.violations,
        alike=round(max(others, default=0.0), 3),
        climbers=climber_rows(
            candidate.route, pool.near(tuple(candidate.holds)), pool.unit, bodies
        ),
    )


def grade_row(found: Range) -> GradeRow:
    """Return a range with its grades by name."""
    return GradeRow(FONT[found.low], FONT[found.high], found.coverage, found.graded)
