"""Endpoints of planned resets: setters plan and sign off, forerunners propose grades."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date, datetime
from typing import Annotated, Final, Self
from uuid import UUID

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.people import names_by_id
from walltopo_gym.api.fields import Body, Day, LongText, Name, Text
from walltopo_gym.api.services import Db
from walltopo_gym.errors import ForbiddenError
from walltopo_gym.gyms.access import Access, PublisherMay, SetterMay, gym_rule
from walltopo_gym.gyms.models import Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route
from walltopo_gym.reset_plans.models import GradeProposal, ResetPerson, SignOff
from walltopo_gym.reset_plans.proposals import (
    ProposalMedian,
    labels_of,
    median_of,
    proposals_of,
    propose,
    sign_off,
    sign_offs_of,
)
from walltopo_gym.reset_plans.service import (
    Part,
    PlanDraft,
    Planned,
    ResetState,
    Wish,
    choose_state,
    people_of,
    plan_of,
    plans_of,
    route_in,
    routes_of,
    store_plan,
)
from walltopo_gym.texts import same_key
from walltopo_gym.walls.lookup import wall_of

router = APIRouter(tags=["reset plans"])

MemberMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]
ProposerMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
PlannerMay = Annotated[Access, gym_rule(Role.SETTER, Scope.READ)]

_MAX_FOUND: Final = 20

Mark = Annotated[int, Field(ge=1, le=5)]


class GradeWish(Body):
    """A wished number of routes of a grade."""

    system: UUID
    grade: Name
    routes: int = Field(ge=1, le=1000)


class NewResetPlan(Body):
    """A planned reset; it replaces the earlier words of the same plan.

    `setters` have the setter role; `forerunners` are members who propose grades besides the
    setters.
    """

    wall_id: UUID
    day: Day
    note: str = Field("", max_length=500, pattern=LongText)
    wishes: list[GradeWish] = Field(default_factory=list, max_length=200)
    setters: list[UUID] = Field(default_factory=list, max_length=50)
    forerunners: list[UUID] = Field(default_factory=list, max_length=50)


class ChosenState(Body):
    state: ResetState


class ResetPersonOut(BaseModel):
    """A person whom a plan names, or may name."""

    id: UUID
    name: str


class ResetPlanOut(BaseModel):
    """A planned reset. `routes`: number of its routes now, `signed_off`: of them with an agreed
    grade. `published_at` is null while the plan is open."""

    id: UUID
    wall_id: UUID
    wall_name: str
    day: date
    note: str
    state: ResetState
    published_at: datetime | None
    wishes: list[GradeWish]
    setters: list[ResetPersonOut]
    forerunners: list[ResetPersonOut]
    routes: int
    signed_off: int


class NewProposal(Body):
    """One's proposal for a route; what is null or empty is left open."""

    grade_system_id: UUID | None = None
    grade: Text = Field("", max_length=80)
    risk: Mark | None = None
    intensity: Mark | None = None
    complexity: Mark | None = None
    note: str = Field("", max_length=300, pattern=LongText)


class OwnProposal(BaseModel):
    """The stored proposal of the person who asks: a grade for a planned route."""

    grade_system_id: UUID | None
    grade: str
    risk: int | None
    intensity: int | None
    complexity: int | None
    note: str
    changed_at: datetime


class ProposalOut(OwnProposal):
    """A forerunner's proposal of a grade for a planned route, with the forerunner's name."""

    person_name: str

    @classmethod
    def of(cls, row: GradeProposal, name: str) -> Self:
        """Return the message of a proposal, by its author's name."""
        own = OwnProposal.model_validate(row, from_attributes=True)
        return cls(person_name=name, **own.model_dump())


class SignOffOut(BaseModel):
    """The agreed grade; `person_name` is empty after the deletion of the signer's account."""

    person_name: str
    grade: str
    signed_at: datetime


class RouteToForerun(BaseModel):
    """A route of a plan, with one's own proposal."""

    id: UUID
    name: str
    colour: str
    setter: str
    grade_system_id: UUID | None
    grade: str
    sign_off: SignOffOut | None
    own: OwnProposal | None


class PlannedRoute(RouteToForerun):
    """A route of a plan, with all proposals and their median."""

    proposals: list[ProposalOut]
    median: ProposalMedian | None


class PlanWithRoutes(BaseModel):
    """A plan with its routes."""

    plan: ResetPlanOut
    routes: list[PlannedRoute]


class ForerunSheet(BaseModel):
    """A plan's routes for one forerunner, who does not see what others propose."""

    wall_id: UUID
    wall_name: str
    day: date
    note: str
    state: ResetState
    routes: list[RouteToForerun]


@router.get("/gyms/{gym}/reset-plans")
def list_reset_plans(session: Db, access: MemberMay) -> list[ResetPlanOut]:
    """Return the plans, open ones first; to members without the setter role the open ones that
    name them as forerunners."""
    known = plans_of(session, access.gym)
    if not access.role.covers(Role.SETTER):
        mine = select(ResetPerson.plan_id).where(
            ResetPerson.person_id == access.actor.known, ResetPerson.part == Part.FORERUNNER
        )
        named = set(session.scalars(mine))
        known = [one for one in known if one.published_at is None and one.plan.id in named]
    return _plans_out(session, known)


@router.get("/gyms/{gym}/reset-plans/people")
def find_reset_people(
    session: Db,
    access: PlannerMay,
    named: Annotated[Text, Query(description="part of a member's name")] = "",
) -> list[ResetPersonOut]:
    """Return everybody with the setter role; or, by two letters or more, the first members whose
    name has them."""
    found = select(Person.id, Person.name).join(Membership, Membership.person_id == Person.id)
    found = found.where(Membership.gym_id == access.gym.id).order_by(Person.name, Person.id)
    if not named:
        found = found.where(Membership.role.in_((Role.SETTER, Role.OWNER)))
    rows = [ResetPersonOut(id=row.id, name=row.name) for row in session.execute(found)]
    if not named:
        return rows
    # Here and not in SQL: SQLite lowers no letters but A to Z.
    wanted = same_key(named)
    return [row for row in rows if len(wanted) > 1 and wanted in same_key(row.name)][:_MAX_FOUND]


@router.put("/gyms/{gym}/reset-plans/{plan}")
def put_reset_plan(
    plan: UUID, body: NewResetPlan, response: Response, session: Db, access: SetterMay
) -> ResetPlanOut:
    """Plan a reset under an id that the browser made, so that it is stored once; or change it."""
    wall = wall_of(session, access.gym.id, body.wall_id)
    words = PlanDraft(
        body.day,
        body.note,
        [Wish(wish.system, wish.grade, wish.routes) for wish in body.wishes],
        {Part.SETTER: frozenset(body.setters), Part.FORERUNNER: frozenset(body.forerunners)},
    )
    row, is_new = store_plan(session, access.gym, wall, plan, words)
    access.log_change(
        session, "reset.plan" if is_new else "reset.change", str(row.id), wall=wall.name
    )
    response.status_code = 201 if is_new else 200
    return _plans_out(session, [plan_of(session, access.gym, plan)])[0]


@router.get("/gyms/{gym}/reset-plans/{plan}")
def read_reset_plan(plan: UUID, session: Db, access: PlannerMay) -> PlanWithRoutes:
    """Return a plan with its routes, the proposals for them and their sign-off."""
    return _with_routes(session, access, plan_of(session, access.gym, plan))


@router.put("/gyms/{gym}/reset-plans/{plan}/state")
def put_reset_state(plan: UUID, body: ChosenState, session: Db, access: SetterMay) -> ResetPlanOut:
    """Set the state of a plan; after a publication of the wall that is impossible."""
    known = plan_of(session, access.gym, plan)
    choose_state(session, access.gym.id, known, body.state)
    access.log_change(session, "reset.state", str(plan), state=body.state)
    session.flush()
    return _plans_out(session, [plan_of(session, access.gym, plan)])[0]


@router.delete("/gyms/{gym}/reset-plans/{plan}", status_code=204)
def drop_reset_plan(plan: UUID, session: Db, access: SetterMay) -> None:
    """Delete a plan. Routes, proposals and signed-off grades stay."""
    known = plan_of(session, access.gym, plan)
    session.delete(known.plan)
    access.log_change(session, "reset.delete", str(plan), wall=known.wall.name)


@router.get("/gyms/{gym}/reset-plans/{plan}/forerun")
def read_forerun(plan: UUID, session: Db, access: MemberMay) -> ForerunSheet:
    """Return the routes of a plan, each with one's own proposal."""
    known = _forerunners_plan(session, access, plan)
    routes = routes_of(session, [known])[known.plan.id]
    keys = [route.id for route in routes]
    mine = {
        row.route_id: row
        for row in session.scalars(
            select(GradeProposal).where(
                GradeProposal.person_id == access.actor.known, GradeProposal.route_id.in_(keys)
            )
        )
    }
    signed = sign_offs_of(session, keys)
    return ForerunSheet(
        wall_id=known.wall.id,
        wall_name=known.wall.name,
        day=known.plan.day,
        note=known.plan.note,
        state=known.state,
        routes=[_to_forerun(route, signed, mine.get(route.id)) for route in routes],
    )


@router.put("/gyms/{gym}/reset-plans/{plan}/routes/{route}/proposal")
def put_proposal(
    plan: UUID, route: UUID, body: NewProposal, session: Db, access: ProposerMay
) -> OwnProposal:
    """Propose grade, risk, intensity and complexity of a route, or change one's proposal."""
    found = route_in(session, _forerunners_plan(session, access, plan), route)
    row = propose(session, access.gym.id, found, access.actor.known, body.model_dump())
    return OwnProposal.model_validate(row, from_attributes=True)


@router.delete("/gyms/{gym}/reset-plans/{plan}/routes/{route}/proposal", status_code=204)
def drop_proposal(plan: UUID, route: UUID, session: Db, access: ProposerMay) -> None:
    """Delete one's proposal for a route."""
    found = route_in(session, _forerunners_plan(session, access, plan), route)
    mine = GradeProposal.route_id == found.id, GradeProposal.person_id == access.actor.known
    session.execute(delete(GradeProposal).where(*mine))


class AgreedGrade(Body):
    grade_system_id: UUID
    grade: Name


@router.put("/gyms/{gym}/reset-plans/{plan}/routes/{route}/sign-off")
def put_sign_off(
    plan: UUID, route: UUID, body: AgreedGrade, session: Db, access: PublisherMay
) -> PlannedRoute:
    """Write the agreed grade to a route, and record who signed it off."""
    known = plan_of(session, access.gym, plan)
    found = route_in(session, known, route)
    me = access.actor.known
    sign_off(session, access.gym.id, found, body.grade_system_id, body.grade, me)
    access.log_change(session, "reset.sign-off", str(route), grade=body.grade)
    return next(row for row in _with_routes(session, access, known).routes if row.id == route)


def _forerunners_plan(session: Session, access: Access, plan: UUID) -> Planned:
    """Return a plan for its forerunners: everybody with the setter role, and members named by it.

    Raises
    ------
    ForbiddenError : the plan does not name this person.
    """
    known = plan_of(session, access.gym, plan)
    if not access.role.covers(Role.SETTER):
        mine = (known.plan.id, access.actor.known, Part.FORERUNNER)
        if session.get(ResetPerson, mine) is None:
            raise ForbiddenError("reset-not-named", "reset-ask")
    return known


def _plans_out(session: Session, plans: Sequence[Planned]) -> list[ResetPlanOut]:
    routes = routes_of(session, plans)
    signed = sign_offs_of(session, [route.id for rows in routes.values() for route in rows])
    named = people_of(session, routes)
    names = names_by_id(session, (row.person_id for row in named))

    def people(plan: UUID, part: Part) -> list[ResetPersonOut]:
        mine = [row.person_id for row in named if row.plan_id == plan and row.part == part]
        facts = [ResetPersonOut(id=person, name=names[person]) for person in mine]
        return sorted(facts, key=lambda one: one.name)

    return [
        ResetPlanOut(
            id=one.plan.id,
            wall_id=one.wall.id,
            wall_name=one.wall.name,
            day=one.plan.day,
            note=one.plan.note,
            state=one.state,
            published_at=one.published_at,
            wishes=[GradeWish(**wish) for wish in one.plan.wishes],
            setters=people(one.plan.id, Part.SETTER),
            forerunners=people(one.plan.id, Part.FORERUNNER),
            routes=len(routes[one.plan.id]),
            signed_off=sum(route.id in signed for route in routes[one.plan.id]),
        )
        for one in plans
    ]


def _with_routes(session: Session, access: Access, known: Planned) -> PlanWithRoutes:
    routes = routes_of(session, [known])[known.plan.id]
    keys = [route.id for route in routes]
    proposals, signed = proposals_of(session, keys), sign_offs_of(session, keys)
    systems = labels_of(session, access.gym.id)
    rows = []
    for route in routes:
        given = proposals.get(route.id, [])
        mine = next((row for row, _ in given if row.person_id == access.actor.known), None)
        rows.append(
            PlannedRoute(
                **_to_forerun(route, signed, mine).model_dump(),
                proposals=[ProposalOut.of(row, name) for row, name in given],
                median=median_of([row for row, _ in given], systems),
            )
        )
    return PlanWithRoutes(plan=_plans_out(session, [known])[0], routes=rows)


def _to_forerun(
    route: Route, signed: Mapping[UUID, tuple[SignOff, str]], own: GradeProposal | None
) -> RouteToForerun:
    sign, name = signed.get(route.id, (None, ""))
    return RouteToForerun(
        id=route.id,
        name=route.name,
        colour=route.colour,
        setter=route.setter,
        grade_system_id=route.grade_system_id,
        grade=route.grade,
        sign_off=None
        if sign is None
        else SignOffOut(person_name=name, grade=sign.grade, signed_at=sign.signed_at),
        own=None if own is None else OwnProposal.model_validate(own, from_attributes=True),
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)
