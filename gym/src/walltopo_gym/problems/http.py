"""Endpoints of climbers' problems and of their moderation."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Final, Literal
from uuid import UUID

import msgspec
from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy import Select, delete, select
from sqlalchemy.orm import Session

from walltopo_climb.grades.model import shipped_identity
from walltopo_climb.movement.reach import HEIGHTS
from walltopo_gym.accounts.access import SignedInMay
from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.limits import count_estimate, count_report
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Complaint, Moment, Name, Note, Text
from walltopo_gym.api.grades import GradeBounds
from walltopo_gym.api.paging import Cursor, Page, Size, page_by
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.turns import turn_for
from walltopo_gym.climbing.ascents import EditOriginIn
from walltopo_gym.climbing.sharing import Share
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.events import GradeRangeOf, collect_answers
from walltopo_gym.gyms.access import Access, GuestMay, PublisherMay, SetterMay, gym_rule
from walltopo_gym.gyms.members import check_not_banned
from walltopo_gym.gyms.roles import Role
from walltopo_gym.problems.estimate import Estimator
from walltopo_gym.problems.models import Problem, ProblemReport
from walltopo_gym.problems.service import (
    MAX_HOLDS,
    ProblemDraft,
    Shown,
    Use,
    UsedHold,
    check_holds,
    delete_problem,
    make_route,
    problem_of,
    problems_shown,
    set_climbed,
    shown_problems,
    store_problem,
    with_hold,
)
from walltopo_gym.publishing.service import grade_of
from walltopo_gym.publishing.version_holds import VersionHolds, check_version, version_holds
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["problems"])

ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]
EstimateTurn = Annotated[None, turn_for("problem-estimate")]


class HoldUse(Body):
    """A hold by its id in a version of the wall, and what it is for."""

    hold: int = Field(ge=1, le=65535)
    use: Use


Holds = Annotated[list[HoldUse], Field(min_length=2, max_length=MAX_HOLDS)]


class NewProblem(Body):
    """A complete problem; the ids of its holds are those of the version `scan_id`."""

    wall_id: UUID
    scan_id: UUID
    holds: Holds
    name: Name
    grade_system_id: UUID | None = None
    grade: Text = ""
    share: Share = Share.PRIVATE
    matching: bool = True
    note: Note = ""
    remix_of: UUID | None = None
    edit: EditOriginIn | None = None


class ClimberProblem(BaseModel):
    """A problem on the wall as it is now.

    `holds` are those that are on the wall, with their ids in the published version; `gone` counts
    the others. `author` is empty for people who are not members. `climbed_at` is one's own ascent.
    `route_id`: the route that a setter made of it. `hidden`: only its author and setters see it.
    """

    id: UUID
    wall_id: UUID
    name: str
    grade_system_id: UUID | None
    grade: str
    share: Share
    matching: bool
    note: str
    holds: list[HoldUse]
    gone: int
    author_id: UUID | None
    author: str
    climbers: int
    climbed_at: datetime | None
    remix_of: UUID | None
    route_id: UUID | None
    hidden: bool
    created_at: datetime


@router.put("/gyms/{gym}/problems/{problem}")
def put_problem(
    problem: UUID, body: NewProblem, response: Response, services: ServicesOf, access: ClimberMay
) -> ClimberProblem:
    """Store a problem under an id that the phone made, so that it is stored once. Sending it again
    with other fields changes it. A deleted problem stays deleted. The response is the stored state:
    a late copy of an older `edit` changes nothing."""
    me = access.actor.known
    with services.database.reading() as session:
        stored = session.get(Problem, problem)
        is_deleted = stored is not None and stored.taken_back_at is not None
        if not is_deleted:
            check_version(session, wall_of(session, access.gym.id, body.wall_id), body.scan_id)
    known = {} if is_deleted else version_holds(services.store, body.scan_id).by_id
    edit = body.edit.read() if body.edit else None
    with services.database.writing() as session:
        check_not_banned(session, access.gym.id, me)
        wall = wall_of(session, access.gym.id, body.wall_id)
        words = _problem_draft(session, access, body)
        row, is_new = store_problem(
            session,
            problem,
            me,
            wall,
            words,
            known,
            edit,
            is_setter=access.role.covers(Role.SETTER),
        )
    response.status_code = 201 if is_new else 200
    with services.database.reading() as session:
        return _climber_problem(session, services.store, access, row)


@router.get("/gyms/{gym}/walls/{wall}/problems")
def list_problems(
    wall: UUID,
    session: Db,
    services: ServicesOf,
    access: ReaderMay,
    cursor: Cursor = None,
    size: Size = 50,
    mine: Annotated[bool, Query(description="only one's own")] = False,
    hold: Annotated[
        int | None, Query(ge=1, le=65535, description="only those with this published hold")
    ] = None,
) -> Page[ClimberProblem]:
    """Return a wall's problems that all members see, and one's own, the newest first."""
    found = wall_of(session, access.gym.id, wall)
    me = access.actor.known
    rows = problems_shown(found, me, mine=mine, is_setter=access.role.covers(Role.SETTER))
    if hold is not None:
        rows = rows.where(with_hold(session, services.store, found, hold))
    order = Problem.created_at, Problem.id
    page, following = page_by(session, rows, order, cursor, size)
    problems = shown_problems(session, services.store, found, [row[0] for row in page], me)
    return Page(items=[_problem_out(access, one) for one in problems], next=following)


@router.get("/gyms/{gym}/problems/{problem}")
def read_problem(
    problem: UUID, session: Db, services: ServicesOf, access: GuestMay
) -> ClimberProblem:
    """Return a problem; one that is shared by link also for people who are not members."""
    return _climber_problem(session, services.store, access, _problem(session, access, problem))


@router.delete("/me/problems/{problem}", status_code=204)
def drop_problem(problem: UUID, session: Db, actor: SignedInMay) -> None:
    """Delete one's own problem; repeating it is fine."""
    row = session.get(Problem, problem)
    if row is None or row.person_id != actor.known:
        raise NotFoundError("not-there-problem")
    delete_problem(session, row)


class ProblemClimbed(Body):
    """Whether one has climbed a problem; `climbed_at` is null: not."""

    climbed_at: Moment | None
    edit: EditOriginIn | None = None


@router.put("/gyms/{gym}/problems/{problem}/climbed", status_code=204)
def put_problem_climbed(
    problem: UUID, body: ProblemClimbed, session: Db, access: ClimberMay
) -> None:
    """Store whether one has climbed a problem. A late copy of an older `edit` changes nothing."""
    row = _problem(session, access, problem)
    edit = body.edit.read() if body.edit else None
    set_climbed(session, access.gym, row, access.actor.known, body.climbed_at, edit)


class ProblemOfHolds(Body):
    """The holds of a problem in the published version `scan_id`."""

    scan_id: UUID
    holds: Holds


class ReachOut(BaseModel):
    """Whether the movement model finds moves to the top for a climber of this height."""

    height_m: float
    reached: bool


class ProblemEstimate(BaseModel):
    """The movement model's estimate for a problem. `grades` is null if it finds no moves for an
    adult; its error is that of the ranges of routes."""

    grades: GradeBounds | None
    heights: list[ReachOut]


def _ready_problem(
    wall: UUID, body: ProblemOfHolds, services: ServicesOf, access: Access
) -> tuple[list[UsedHold], VersionHolds]:
    """Return the holds of a request for the movement model, which counts as an estimate."""
    with services.database.reading() as session:
        check_version(session, wall_of(session, access.gym.id, wall), body.scan_id)
    used, version = _used_holds(body.holds), version_holds(services.store, body.scan_id)
    check_holds(version.by_id, used)
    with services.database.writing() as session:
        count_estimate(session, access.actor.known)
    return used, version


@router.post("/gyms/{gym}/walls/{wall}/problem-estimate")
def estimate_problem(
    wall: UUID, body: ProblemOfHolds, _: EstimateTurn, services: ServicesOf, access: ClimberMay
) -> ProblemEstimate:
    """Estimate grade and reach of a problem before it is stored."""
    used, version = _ready_problem(wall, body, services, access)
    made = services.get(Estimator).estimate(used, version)
    grades = None
    if made.difficulty is not None:
        with services.database.reading() as session:
            ranges = collect_answers(
                session,
                GradeRangeOf(
                    access.gym.id, body.scan_id, shipped_identity(), made.difficulty, made.known
                ),
            )
        grades = ranges[0] if ranges else None
    return ProblemEstimate(
        grades=None if grades is None else GradeBounds.of(grades),
        heights=[ReachOut(height_m=one, reached=one in made.heights) for one in HEIGHTS],
    )


class MoveOut(BaseModel):
    """A move of one limb, as in `moves.json`."""

    limb: str
    holds: tuple[int, int, int, int]
    hip: tuple[float, float, float]
    effort: float
    beyond_m: float


class BodyMoves(BaseModel):
    """The moves of one body, as in `moves.json`; none if its start is out of reach."""

    climber: str
    height_m: float
    span_m: float
    reached: bool
    crux: int
    moves: list[MoveOut]


class ProblemMoves(BaseModel):
    """The moves of several bodies on a problem; `unit`: of the scan, per metre."""

    unit: float
    climbers: list[BodyMoves]


@router.post("/gyms/{gym}/walls/{wall}/problem-moves")
def find_problem_moves(
    wall: UUID, body: ProblemOfHolds, _: EstimateTurn, services: ServicesOf, access: ClimberMay
) -> ProblemMoves:
    """Find the likely moves of a child, and of a short, an adult and a tall climber."""
    used, version = _ready_problem(wall, body, services, access)
    rows = services.get(Estimator).moves(used, version)
    climbers = [BodyMoves.model_validate(msgspec.to_builtins(row)) for row in rows]
    return ProblemMoves(unit=version.unit, climbers=climbers)


class OpeningOut(BaseModel):
    """A hold of the version that opens a problem: with it the shortest climber who reaches the top
    is `height_m` tall."""

    hold: int
    use: Literal[Use.HAND, Use.FOOT]
    height_m: float


@router.post("/gyms/{gym}/walls/{wall}/problem-openings")
def find_problem_openings(
    wall: UUID, body: ProblemOfHolds, _: EstimateTurn, services: ServicesOf, access: ClimberMay
) -> list[OpeningOut]:
    """Find the holds that open a problem to shorter climbers, the best first."""
    used, version = _ready_problem(wall, body, services, access)
    return [
        OpeningOut(hold=one.hold, use=Use.FOOT if one.foot else Use.HAND, height_m=one.height)
        for one in services.get(Estimator).openings(used, version)
    ]


@router.post("/gyms/{gym}/problems/{problem}/promote")
def promote_problem(problem: UUID, services: ServicesOf, access: PublisherMay) -> ClimberProblem:
    """Make a route of a problem that others see; repeating it is fine."""
    with services.database.writing() as session:
        row = _problem(session, access, problem)
        wall = session.get_one(Wall, row.wall_id)
        route = make_route(session, wall, row)
        access.log_change(session, "problem.promote", str(row.id), route=str(route.id))
    with services.database.reading() as session:
        return _climber_problem(session, services.store, access, row)


class ProblemReportOut(BaseModel):
    """A report on a problem; `text`: its name and note at that time. The reporter is unnamed."""

    id: UUID
    problem_id: UUID
    wall_id: UUID
    author_id: UUID
    author: str
    text: str
    reason: str
    created_at: datetime


@router.put("/gyms/{gym}/problems/{problem}/report", status_code=204)
def report_problem(problem: UUID, body: Complaint, session: Db, access: ClimberMay) -> None:
    """Report a problem to the gym. Repeated reports count once."""
    row = _problem(session, access, problem)
    me = access.actor.known
    count_report(session, me)
    mine = select(ProblemReport).where(
        ProblemReport.problem_id == row.id, ProblemReport.person_id == me
    )
    report = session.scalar(mine) or ProblemReport(problem_id=row.id, person_id=me)
    report.text = "\n".join(filter(None, (row.name, row.note)))
    report.reason = body.reason
    session.add(report)


@router.get("/gyms/{gym}/problem-reports")
def list_problem_reports(
    session: Db, access: SetterMay, cursor: Cursor = None, size: Size = 50
) -> Page[ProblemReportOut]:
    """Return reported problems without a decision, the newest first."""
    rows: Select[*tuple[Any, ...]] = (
        select(ProblemReport, Problem, Person.name, ProblemReport.created_at, ProblemReport.id)
        .join(Problem, Problem.id == ProblemReport.problem_id)
        .join(Wall, Wall.id == Problem.wall_id)
        .join(Person, Person.id == Problem.person_id)
        .where(Wall.gym_id == access.gym.id, Problem.taken_back_at.is_(None))
    )
    order = ProblemReport.created_at, ProblemReport.id
    found, following = page_by(session, rows, order, cursor, size)
    items = [
        ProblemReportOut(
            id=report.id,
            problem_id=row.id,
            wall_id=row.wall_id,
            author_id=row.person_id,
            author=name,
            text=report.text,
            reason=report.reason,
            created_at=report.created_at,
        )
        for report, row, name, *_ in found
    ]
    return Page(items=items, next=following)


@router.delete("/gyms/{gym}/problem-reports/{report}", status_code=204)
def dismiss_problem_report(report: UUID, session: Db, access: SetterMay) -> None:
    """Keep a reported problem and close the report."""
    row = session.get(ProblemReport, report)
    if row is None:
        raise NotFoundError("not-there-report")
    problem = _problem(session, access, row.problem_id)
    session.delete(row)
    access.log_change(session, "problem.keep", str(problem.id))


@router.put("/gyms/{gym}/problems/{problem}/hidden", status_code=204)
def hide_problem(problem: UUID, session: Db, access: SetterMay) -> None:
    """Hide a problem from all but its author and setters, and close its reports."""
    row = _problem(session, access, problem)
    row.hidden_at = row.hidden_at or now()
    session.execute(delete(ProblemReport).where(ProblemReport.problem_id == row.id))
    access.log_change(session, "problem.hide", str(row.id))


@router.delete("/gyms/{gym}/problems/{problem}/hidden", status_code=204)
def show_problem(problem: UUID, session: Db, access: SetterMay) -> None:
    """Show a hidden problem again; repeating it is fine."""
    row = _problem(session, access, problem)
    if row.hidden_at is not None:
        row.hidden_at = None
        access.log_change(session, "problem.show", str(row.id))


def _problem_draft(session: Session, access: Access, body: NewProblem) -> ProblemDraft:
    grade = grade_of(session, access.gym.id, body.grade_system_id, body.grade)
    return ProblemDraft(
        body.scan_id,
        _used_holds(body.holds),
        body.name,
        body.grade_system_id,
        grade,
        body.share,
        body.matching,
        body.note,
        body.remix_of,
    )


def _used_holds(holds: list[HoldUse]) -> list[UsedHold]:
    return [UsedHold(each.hold, each.use) for each in holds]


def _problem(session: Session, access: Access, problem: UUID) -> Problem:
    return problem_of(
        session,
        access.gym.id,
        problem,
        access.actor.person,
        is_member=access.role.covers(Role.MEMBER),
        is_setter=access.role.covers(Role.SETTER),
    )


def _climber_problem(
    session: Session, store: FileStore, access: Access, row: Problem
) -> ClimberProblem:
    wall = session.get_one(Wall, row.wall_id)
    [one] = shown_problems(session, store, wall, [row], access.actor.person)
    return _problem_out(access, one)


def _problem_out(access: Access, one: Shown) -> ClimberProblem:
    row, is_member = one.problem, access.role.covers(Role.MEMBER)
    return ClimberProblem(
        id=row.id,
        wall_id=row.wall_id,
        name=row.name,
        grade_system_id=row.grade_system_id,
        grade=row.grade,
        share=Share(row.share),
        matching=row.matching,
        note=row.note,
        holds=[HoldUse(hold=each.hold, use=each.use) for each in one.holds],
        gone=one.gone,
        author_id=row.person_id if is_member else None,
        author=one.author if is_member else "",
        climbers=one.climbers,
        climbed_at=one.climbed_at,
        remix_of=row.remix_of,
        route_id=row.route_id,
        hidden=row.hidden_at is not None,
        created_at=row.created_at,
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)
