"""Forerunners' proposals for a route, their median, and the sign-off of the agreed grade."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median, median_low
from typing import Any
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.people import lock_person
from walltopo_gym.clock import now
from walltopo_gym.errors import RequestError
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.service import change_facts, grade_of
from walltopo_gym.reset_plans.models import GradeProposal, SignOff


@dataclass(frozen=True)
class ProposalMedian:
    """The median of a route's proposals.

    Parameters
    ----------
    proposals : their number. grade : of the most used grade system; of an even number of grades the
        easier one of the two in the middle; empty if nobody proposed one.
    """

    proposals: int
    grade_system_id: UUID | None
    grade: str
    risk: float | None
    intensity: float | None
    complexity: float | None


def propose(
    session: Session, gym: UUID, route: Route, person: UUID, words: Mapping[str, Any]
) -> GradeProposal:
    """Store a person's proposal for a route, in place of an earlier one.

    Parameters
    ----------
    words : columns of `GradeProposal`.

    Raises
    ------
    RequestError : the grade is not the gym's.
    """
    grade = grade_of(session, gym, words["grade_system_id"], words["grade"])
    # One person's come one after the other, so that two copies at once are one.
    lock_person(session, person)
    row = session.get(GradeProposal, (route.id, person))
    if row is None:
        row = GradeProposal(route_id=route.id, person_id=person)
        session.add(row)
    for name, value in {**words, "grade": grade}.items():
        setattr(row, name, value)
    row.changed_at = now()
    session.flush()
    return row


def proposals_of(
    session: Session, routes: Iterable[UUID]
) -> dict[UUID, list[tuple[GradeProposal, str]]]:
    """Return the proposals for routes with their authors' names, the earliest first."""
    found: dict[UUID, list[tuple[GradeProposal, str]]] = {}
    rows = session.execute(
        select(GradeProposal, Person.name)
        .join(Person, Person.id == GradeProposal.person_id)
        .where(GradeProposal.route_id.in_(list(routes)))
        .order_by(GradeProposal.changed_at, Person.id)
    )
    for row, name in rows:
        found.setdefault(row.route_id, []).append((row, name))
    return found


def median_of(
    proposals: Sequence[GradeProposal], systems: Mapping[UUID, Sequence[str]]
) -> ProposalMedian | None:
    """Return the median of proposals, None without any.

    Parameters
    ----------
    systems : labels of the gym's grade systems, from the easiest to the hardest.
    """
    if not proposals:
        return None
    graded = [
        (row.grade_system_id, row.grade)
        for row in proposals
        if row.grade_system_id is not None and row.grade in systems.get(row.grade_system_id, ())
    ]
    system, grade = None, ""
    if graded:
        system = Counter(used for used, _ in graded).most_common(1)[0][0]
        labels = systems[system]
        indices = [labels.index(label) for used, label in graded if used == system]
        grade = labels[median_low(indices)]
    return ProposalMedian(
        len(proposals),
        system,
        grade,
        _median(row.risk for row in proposals),
        _median(row.intensity for row in proposals),
        _median(row.complexity for row in proposals),
    )


def _median(values: Iterable[int | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(median(known)) if known else None


def labels_of(session: Session, gym: UUID) -> dict[UUID, list[str]]:
    """Return the labels of each of a gym's grade systems, from the easiest to the hardest."""
    rows = session.scalars(select(GradeSystem).where(GradeSystem.gym_id == gym))
    return {row.id: [str(grade["label"]) for grade in row.grades] for row in rows}


def sign_off(
    session: Session, gym: UUID, route: Route, system: UUID, grade: str, by: UUID
) -> SignOff:
    """Write the agreed grade to a route, and who signed it off; a later one replaces it.

    Raises
    ------
    RequestError : no grade, or not the gym's.
    """
    if not grade:
        raise RequestError("reset-no-grade")
    grade = grade_of(session, gym, system, grade)
    if (route.grade_system_id, route.grade) != (system, grade):
        facts = {"grade_system_id": system, "grade": grade}
        change_facts(session, gym, route, facts, by)
    # The row of the wall is not locked if the grade stays: two signers come one after the other.
    session.execute(select(Route.id).where(Route.id == route.id).with_for_update())
    row = session.get(SignOff, route.id, populate_existing=True)
    if row is None:
        row = SignOff(route_id=route.id)
        session.add(row)
    row.person_id, row.grade, row.signed_at = by, grade, now()
    session.flush()
    return row


def sign_offs_of(session: Session, routes: Iterable[UUID]) -> dict[UUID, tuple[SignOff, str]]:
    """Return the sign-offs of routes with the signers' names, which are empty after deletion."""
    rows = session.execute(
        select(SignOff, Person.name)
        .outerjoin(Person, Person.id == SignOff.person_id)
        .where(SignOff.route_id.in_(list(routes)))
    )
    return {row.route_id: (row, name or "") for row, name in rows}
