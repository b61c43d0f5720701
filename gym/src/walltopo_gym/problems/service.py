"""Store problems, and find their holds on the wall as it is now."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Any, Final
from uuid import UUID

from sqlalchemy import ColumnElement, Select, and_, delete, exists, false, func, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.limits import count_problem
from walltopo_gym.accounts.people import lock_person, names_by_id
from walltopo_gym.climbing.dates import check_climbed
from walltopo_gym.climbing.edits import Edit, is_newer_edit
from walltopo_gym.climbing.sharing import Share, may_see, not_hidden
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.gyms.days import zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.problems.models import Problem, ProblemAscent, ProblemHold
from walltopo_gym.publishing.by_hand import HandRoute, add_routes
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.version_holds import check_version, current_holds
from walltopo_gym.scans.models import Scan
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall

MAX_HOLDS: Final = 60


class Use(StrEnum):
    """The use of a hold in a problem."""

    START = "start"
    HAND = "hand"
    FOOT = "foot"
    TOP = "top"


@dataclass(frozen=True)
class UsedHold:
    """A hold of a problem by its id in a version of the wall."""

    hold: int
    use: Use


@dataclass(frozen=True)
class ProblemDraft:
    """A problem as its author has it; the columns of `Problem` say what the fields are."""

    scan: UUID
    holds: Sequence[UsedHold]
    name: str
    grade_system: UUID | None
    grade: str
    share: Share
    matching: bool
    note: str
    remix_of: UUID | None


@dataclass(frozen=True)
class Shown:
    """A problem with its author's name, the number of its climbers, and one's own ascent.

    Parameters
    ----------
    holds : those that are on the wall now, with their ids in the published version.
    gone : number of the others.
    """

    problem: Problem
    author: str
    climbers: int
    climbed_at: datetime | None
    holds: list[UsedHold]
    gone: int


def check_holds(known: Container[int], holds: Sequence[UsedHold]) -> None:
    """Refuse holds that make no problem.

    Parameters
    ----------
    known : ids of the version's holds.

    Raises
    ------
    RequestError : a hold comes twice or is not in the version, or start or top are missing.
    """
    ids = [used.hold for used in holds]
    if len(set(ids)) < len(ids):
        raise RequestError("problem-hold-twice")
    uses = [used.use for used in holds]
    if not 1 <= uses.count(Use.START) <= 4 or not 1 <= uses.count(Use.TOP) <= 2:
        raise RequestError("problem-start-top")
    if not all(hold in known for hold in ids):
        raise RequestError("hold-unknown")


def store_problem(
    session: Session,
    problem: UUID,
    person: UUID,
    wall: Wall,
    words: ProblemDraft,
    known: Container[int],
    edit: Edit | None,
    *,
    is_setter: bool = False,
) -> tuple[Problem, bool]:
    """Store or change a member's problem; return it and whether it is new.

    A deleted problem stays deleted, and a newer edit stays.

    Parameters
    ----------
    known : ids of the holds of the version `words.scan`.

    Raises
    ------
    RequestError : the holds make no problem, or it remixes one that its author may not see;
        ConflictError : the id belongs to another person or
        wall; TooManyError : the person's limit of a day is reached.
    """
    # One person's problems come one after the other, so that two copies at once are one.
    lock_person(session, person)
    row = session.get(Problem, problem)
    if row is not None and (row.person_id != person or row.wall_id != wall.id):
        raise ConflictError("id-taken", "id-another")
    if row is not None and row.taken_back_at is not None:
        return row, False
    check_version(session, wall, words.scan)
    check_holds(known, words.holds)
    is_new = row is None
    if row is None:
        count_problem(session, person)
        row = Problem(id=problem, wall_id=wall.id, person_id=person)
    if is_newer_edit(row, edit):
        _check_remix(session, wall.gym_id, row, words.remix_of, is_setter=is_setter)
        row.scan_id, row.name, row.note = words.scan, words.name, words.note
        row.grade_system_id, row.grade = words.grade_system, words.grade
        row.share, row.matching, row.remix_of = words.share, words.matching, words.remix_of
        row.holds = [{"hold": used.hold, "use": used.use.value} for used in words.holds]
        session.add(row)
        session.flush()
        store_holds(session, row)
    session.add(row)
    session.flush()
    return row, is_new


def store_holds(session: Session, problem: Problem) -> None:
    """Store the rows of a problem's holds anew."""
    session.execute(delete(ProblemHold).where(ProblemHold.problem_id == problem.id))
    session.add_all(
        ProblemHold(problem_id=problem.id, hold=used["hold"], scan_id=problem.scan_id)
        for used in problem.holds
    )


def _check_remix(
    session: Session, gym: UUID, row: Problem, base: UUID | None, *, is_setter: bool
) -> None:
    """Refuse a remix of a problem that is not this gym's, or that the author may not see.

    A base that was deleted since is accepted, because the remix may have waited for reception. So
    is one that the stored problem names already.

    Raises
    ------
    RequestError : it is refused.
    """
    if base is None or base == row.remix_of:
        return
    in_gym = select(Problem).join(Wall, Wall.id == Problem.wall_id).where(Wall.gym_id == gym)
    found = session.scalar(in_gym.where(Problem.id == base))
    is_seen = found is not None and may_see(
        found, row.person_id, is_member=True, is_setter=is_setter
    )
    if base == row.id or not is_seen:
        raise RequestError("problem-remix-unknown")


def problem_of(
    session: Session,
    gym: UUID,
    problem: UUID,
    person: UUID | None,
    *,
    is_member: bool,
    is_setter: bool = False,
) -> Problem:
    """Return a problem of this gym that the person may see.

    Raises
    ------
    NotFoundError : there is none, or it is not for this person.
    """
    in_gym = select(Problem).join(Wall, Wall.id == Problem.wall_id).where(Wall.gym_id == gym)
    row = session.scalar(in_gym.where(Problem.id == problem, Problem.taken_back_at.is_(None)))
    if row is None or not may_see(row, person, is_member=is_member, is_setter=is_setter):
        raise NotFoundError("not-there-problem")
    return row


def problems_shown(
    wall: Wall, person: UUID, *, mine: bool, is_setter: bool
) -> Select[Problem, datetime, UUID]:
    """Return the query of a wall's problems that a member sees, with time and id of each."""
    rows: Select[Problem, datetime, UUID] = select(Problem, Problem.created_at, Problem.id).where(
        Problem.wall_id == wall.id, Problem.taken_back_at.is_(None)
    )
    if mine:
        return rows.where(Problem.person_id == person)
    seen = not_hidden(Problem, wall.gym_id, is_setter=is_setter)
    in_gym = and_(Problem.share == Share.GYM, seen)
    return rows.where(or_(in_gym, Problem.person_id == person))


def with_hold(session: Session, store: FileStore, wall: Wall, hold: int) -> ColumnElement[bool]:
    """Return the condition that a problem has a hold of the published version, whatever version of
    the wall it was made on."""
    made_on = exists().where(Problem.scan_id == Scan.id)
    scans = session.scalars(select(Scan.id).where(Scan.wall_id == wall.id, made_on)).all()
    used = [
        and_(ProblemHold.scan_id == scan, ProblemHold.hold == old)
        for scan in scans
        for old, current in current_holds(session, store, wall, scan).items()
        if current == hold
    ]
    return Problem.id.in_(select(ProblemHold.problem_id).where(or_(false(), *used)))


def shown_problems(
    session: Session, store: FileStore, wall: Wall, rows: Sequence[Problem], person: UUID | None
) -> list[Shown]:
    """Return the problems of a wall with what a page shows of them."""
    ids = [row.id for row in rows]
    names = names_by_id(session, (row.person_id for row in rows))
    climbed = ProblemAscent.problem_id.in_(ids), ProblemAscent.climbed_at.is_not(None)
    counted = select(ProblemAscent.problem_id, func.count()).where(*climbed)
    counts = dict(session.execute(counted.group_by(ProblemAscent.problem_id)).all())
    own = select(ProblemAscent.problem_id, ProblemAscent.climbed_at).where(
        *climbed, ProblemAscent.person_id == person
    )
    mine = dict(session.execute(own).all())
    scans = {row.scan_id for row in rows}
    current = {scan: current_holds(session, store, wall, scan) for scan in scans}
    found = []
    for row in rows:
        now_at = current[row.scan_id]
        there = [
            UsedHold(now_at[used["hold"]], Use(used["use"]))
            for used in row.holds
            if used["hold"] in now_at
        ]
        found.append(
            Shown(
                row,
                names.get(row.person_id, ""),
                counts.get(row.id, 0),
                mine.get(row.id),
                there,
                len(row.holds) - len(there),
            )
        )
    return found


def delete_problem(session: Session, problem: Problem) -> None:
    """Delete a problem for all but late copies of its edits; its words and holds go."""
    problem.taken_back_at = now()
    problem.name = problem.note = problem.grade = ""
    problem.holds, problem.grade_system_id = [], None
    store_holds(session, problem)


def set_climbed(
    session: Session,
    gym: Gym,
    problem: Problem,
    person: UUID,
    climbed_at: datetime | None,
    edit: Edit | None,
) -> None:
    """Store whether a person has climbed a problem; a late copy of an older edit changes nothing.

    Parameters
    ----------
    climbed_at : None: not climbed. A time of the next hours counts as now.

    Raises
    ------
    RequestError : the time is in the future, or the problem's holds were not there.
    """
    if climbed_at is not None:
        # The problem itself may have waited for reception: the scan of its holds is there first.
        scan = session.get_one(Scan, problem.scan_id)
        check_climbed(climbed_at, min(scan.created_at, problem.created_at), zone_of(gym))
    lock_person(session, person)
    row = session.get(ProblemAscent, (problem.id, person))
    row = row or ProblemAscent(problem_id=problem.id, person_id=person)
    if is_newer_edit(row, edit):
        row.climbed_at = None if climbed_at is None else min(climbed_at, now())
    session.add(row)


def make_route(session: Session, wall: Wall, problem: Problem) -> Route:
    """Make a route of a problem, without a place on the wall until a scan shows it; return it.

    A problem becomes a route once: the route has the problem's id. It has no setter: guests see
    routes, and the author has shown their name to members alone.

    Raises
    ------
    ConflictError : it is private.
    """
    if problem.share == Share.PRIVATE:
        raise ConflictError("problem-private")
    facts: dict[str, Any] = {
        "name": problem.name,
        "colour": "",
        "grade_system_id": problem.grade_system_id,
        "grade": problem.grade,
        "setter": "",
        "tags": [],
        "set_on": now().date(),
        "strip_on": None,
    }
    [route] = add_routes(session, wall, [HandRoute(problem.id, facts)])
    problem.route_id = route.id
    return route
